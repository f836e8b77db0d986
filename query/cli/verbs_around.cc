// SPDX-License-Identifier: Apache-2.0
// The verbs about what hangs together: around, subgraph.
#include <string>

#include "dsg/v1/query_service.pb.h"
#include "query/cli/filter.h"
#include "query/cli/json.h"
#include "query/cli/paging.h"
#include "query/cli/render_search.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {

absl::Status RunAround(Session* session, const AroundVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetNeighborsRequest>();
  request.set_id(verb.id);
  for (const std::string& relation : verb.relations) request.add_relations(relation);
  request.set_outgoing(verb.outgoing);
  request.set_incoming(verb.incoming);
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
    request.set_at_ns(at_ns);
  }
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNeighborsResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::GetNeighborsResponse& page) { return page.neighbors_size(); },
      [&](const v1::GetNeighborsRequest& next, v1::GetNeighborsResponse* page) {
        return session->api().GetNeighbors(session->NewCall(), next, page);
      },
      &all));
  if (session->common().json) return WriteJson(all, out);
  out << RenderNeighbors(all, session->times());
  return absl::OkStatus();
}

absl::Status RunSubgraph(Session* session, const SubgraphVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetSubgraphRequest>();
  request.set_root(verb.id);
  for (const std::string& relation : verb.relations) request.add_relations(relation);
  request.set_both_directions(verb.both_directions);
  request.set_depth_max(verb.depth);
  request.set_tree_only(verb.tree_only);
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  DSG_RETURN_IF_ERROR(FillFilter(verb.filter, session->map(), request.mutable_filter()));
  v1::GetSubgraphResponse all;
  const auto merge = [&](const v1::GetSubgraphResponse& message) {
    all.MergeFrom(message);
    return true;
  };
  DSG_RETURN_IF_ERROR(session->Read(&query::Api::GetSubgraph, request, merge));
  // The root alone: perhaps nothing could pass the filter.
  if (all.nodes_size() <= 1) {
    DSG_RETURN_IF_ERROR(CheckWords(session, "", verb.filter.class_name, ""));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderSubgraph(all, session->times());
  return absl::OkStatus();
}

}  // namespace dsg::cli
