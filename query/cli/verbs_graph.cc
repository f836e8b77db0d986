// SPDX-License-Identifier: Apache-2.0
// The verbs about nodes and edges: ls, edges, show, near.
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "query/cli/filter.h"
#include "query/cli/json.h"
#include "query/cli/paging.h"
#include "query/cli/render_graph.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
absl::Status RunList(Session* session, const ListVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListNodesRequest>();
  v1::NodeFilter* filter = request.mutable_filter();
  DSG_RETURN_IF_ERROR(FillFilter(verb.filter, session->map(), filter));
  filter->set_parent_id(verb.parent);
  filter->set_name(verb.name);
  if (!verb.box.empty()) {
    DSG_ASSIGN_OR_RETURN(const Box3d box, ParseBox("--box", verb.box));
    ToProto(box, filter->mutable_box());
  }
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  v1::ListNodesResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::ListNodesResponse& page) { return page.nodes_size(); },
      [&](const v1::ListNodesRequest& next, v1::ListNodesResponse* page) {
        return session->api().ListNodes(session->NewCall(), next, page);
      },
      &all));
  if (all.nodes().empty()) {
    DSG_RETURN_IF_ERROR(CheckWords(session, verb.filter.layer, verb.filter.class_name, ""));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderNodes(all);
  return absl::OkStatus();
}

absl::Status RunEdges(Session* session, const EdgesVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListEdgesRequest>();
  request.set_source(verb.source);
  request.set_relation(verb.relation);
  request.set_target(verb.target);
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
    request.set_at_ns(at_ns);
  }
  v1::ListEdgesResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::ListEdgesResponse& page) { return page.edges_size(); },
      [&](const v1::ListEdgesRequest& next, v1::ListEdgesResponse* page) {
        return session->api().ListEdges(session->NewCall(), next, page);
      },
      &all));
  if (all.edges().empty()) {
    DSG_RETURN_IF_ERROR(CheckWords(session, "", "", verb.relation));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderEdges(all, session->times());
  return absl::OkStatus();
}

absl::Status RunShow(Session* session, const ShowVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(verb.id);
  request.set_view(v1::NODE_VIEW_FULL);
  v1::GetNodeResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderNode(reply, session->times());
  return absl::OkStatus();
}

absl::Status RunNear(Session* session, const NearVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListNearestNodesRequest>();
  DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d position, ParsePoint("POSITION", verb.position));
  request.mutable_position()->set_x(position.x());
  request.mutable_position()->set_y(position.y());
  request.mutable_position()->set_z(position.z());
  request.set_k(verb.k);
  request.set_max_distance_m(verb.max_distance_m);
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  DSG_RETURN_IF_ERROR(FillFilter(verb.filter, session->map(), request.mutable_filter()));
  v1::ListNearestNodesResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListNearestNodes(session->NewCall(), request, &reply));
  if (reply.nodes().empty()) {
    DSG_RETURN_IF_ERROR(CheckWords(session, "", verb.filter.class_name, ""));
  }
  if (session->common().json) return WriteJson(reply, out);
  out << RenderNearest(reply);
  return absl::OkStatus();
}

}  // namespace dsg::cli
