// SPDX-License-Identifier: Apache-2.0
// The verb find: nodes by what they are, what they are called, what they stand on, where they are.
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/paging.h"
#include "query/cli/render_search.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kHitRgb = 0xc8321e;
constexpr uint32_t kNearRgb = 0x1f5fbf;

absl::StatusOr<v1::SearchNodesRequest> RequestFor(Session* session, const FindVerb& verb) {
  auto request = session->Begin<v1::SearchNodesRequest>();
  request.set_query(absl::StrJoin(verb.words, " "));
  if (!verb.near.empty()) {
    DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d near, ParsePoint("--near", verb.near));
    request.mutable_near()->set_x(near.x());
    request.mutable_near()->set_y(near.y());
    request.mutable_near()->set_z(near.z());
    request.set_max_distance_m(verb.max_distance_m);
  }
  if (!verb.box.empty()) {
    DSG_ASSIGN_OR_RETURN(const Box3d box, ParseBox("--box", verb.box));
    ToProto(box, request.mutable_box());
  }
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
    request.set_at_ns(at_ns);
  }
  request.set_view(v1::NODE_VIEW_GEOMETRY);
  request.set_explain(verb.explain);
  return request;
}

// A mistake in a query is shown where it is, since people rarely count bytes.
absl::Status ShowMistake(const absl::Status& status, const std::string& query) {
  if (ReasonOf(status) != Reason::kQueryMalformed) return status;
  const ErrorMetadata metadata = MetadataOf(status);
  const auto found = metadata.find("position");
  size_t position = 0;
  if (found == metadata.end() || !absl::SimpleAtoi(found->second, &position) ||
      position > query.size()) {
    return status;
  }
  // Servers may draw the query below their first line; errors here are one line.
  const absl::string_view said = status.message();
  return MakeError(Reason::kQueryMalformed,
                   absl::StrCat(said.substr(0, said.find('\n')), ", here: ",
                                query.substr(0, position), " >>>", query.substr(position)),
                   metadata);
}

std::string LabelOf(const v1::Node& node) {
  if (!node.name().empty()) return node.name();
  const std::string& class_name = node.semantic_class().name();
  return class_name.empty() ? node.id() : absl::StrCat(class_name, " ", node.id());
}

AnswerPicture Draw(const v1::SearchNodesRequest& request, const v1::SearchNodesResponse& reply,
                   const FindVerb& verb) {
  AnswerPicture picture{
      .title = absl::StrCat("find ", absl::StrJoin(verb.words, " "), ": ", reply.hits_size()),
      .revision = reply.header().read_revision()};
  if (request.has_at_ns()) picture.at_ns = request.at_ns();
  if (request.has_near()) {
    picture.overlay.marks.push_back({.position_map = PointOf(request.near()),
                                     .rgb = kNearRgb,
                                     .shape = OverlayMark::Shape::kCross,
                                     .label = "from here"});
  }
  for (const v1::SearchHit& hit : reply.hits()) {
    const v1::Node& node = hit.node();
    MarkNode(node, kHitRgb, LabelOf(node), &picture.overlay);
  }
  return picture;
}

absl::Status PrintHits(Session* session, const v1::SearchNodesResponse& reply, std::ostream& out) {
  std::vector<std::string> ids;
  for (const v1::SearchHit& hit : reply.hits()) {
    ids.insert(ids.end(), hit.ancestor_ids().begin(), hit.ancestor_ids().end());
    ids.insert(ids.end(), hit.related_ids().begin(), hit.related_ids().end());
  }
  DSG_ASSIGN_OR_RETURN(const NodeNames names,
                       NamesOf(session, reply.header().read_revision(), ids));
  out << RenderHits(reply, names);
  return absl::OkStatus();
}

}  // namespace

absl::Status RunFind(Session* session, const FindVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::SearchNodesRequest request, RequestFor(session, verb));
  v1::SearchNodesResponse all;
  const absl::Status found = FetchPages(
      request, session->common().limit,
      [](const v1::SearchNodesResponse& page) { return page.hits_size(); },
      [&](v1::SearchNodesRequest next, v1::SearchNodesResponse* page) {
        // The plan is that of the first page.
        next.set_explain(next.explain() && next.page_token().empty());
        return session->api().SearchNodes(session->NewCall(), next, page);
      },
      &all);
  DSG_RETURN_IF_ERROR(ShowMistake(found, request.query()));
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(all, out));
  } else {
    DSG_RETURN_IF_ERROR(PrintHits(session, all, out));
  }
  return WritePicture(session, verb.picture, Draw(request, all, verb), out);
}

}  // namespace dsg::cli
