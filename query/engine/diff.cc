// SPDX-License-Identifier: Apache-2.0
// What differs between two revisions of a map: nodes, edges, tracks, mesh blocks.
// Refuses to tell the steps between them: a node that came and went is not there.
#include <algorithm>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "query/engine/difference.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/page_token.h"
#include "query/engine/read_view.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

absl::Status CheckRevision(std::string_view field, Revision revision) {
  if (revision >= 0) return absl::OkStatus();
  return FieldError(field, absl::StrCat(revision), "revisions count from 0, the empty map");
}

// Where a page begins, and the revision that was the newest on the first one.
absl::StatusOr<PageToken> StartOf(MapReader* map, const v1::DiffRevisionsRequest& request,
                                  uint64_t question) {
  PageToken start;
  if (!request.page_token().empty()) {
    DSG_ASSIGN_OR_RETURN(start, DecodePageToken(request.page_token(), question));
    DSG_RETURN_IF_ERROR(CheckToken(start, *map));
    return start;
  }
  start.incarnation = DigestOf(*map);
  start.revision = request.to_revision();
  if (request.has_to_revision()) return start;
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  start.revision = head.revision;
  return start;
}

uint64_t QuestionOf(const v1::DiffRevisionsRequest& request) {
  v1::DiffRevisionsRequest question = request;
  question.clear_page_size();
  question.clear_page_token();
  return QuestionDigest("DiffRevisions", question);
}

}  // namespace

absl::Status DiffRevisions(Engine* engine, const CallContext& call,
                           const v1::DiffRevisionsRequest& request,
                           v1::DiffRevisionsResponse* reply) {
  DSG_RETURN_IF_ERROR(CheckRevision("from_revision", request.from_revision()));
  DSG_RETURN_IF_ERROR(CheckRevision("to_revision", request.to_revision()));
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const int size, CheckPageSize(request.page_size()));
  const uint64_t question = QuestionOf(request);
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(const PageToken start, StartOf(map.get(), request, question));
  const Revision from = request.from_revision();
  const Revision to = start.revision;

  DSG_ASSIGN_OR_RETURN(const ReadView view,
                       ReadView::OpenAt(&engine->maps, map, std::max(from, to)));
  DSG_ASSIGN_OR_RETURN(
      const auto difference,
      Difference::Open(map, from, to, {request.layer(), request.view()}, call.stop()));
  view.FillHeader(reply->mutable_header());
  reply->set_from_revision(from);
  reply->set_to_revision(to);
  DSG_ASSIGN_OR_RETURN(std::string next, difference->AddPage(start.position, size, call, reply));
  if (!next.empty()) {
    reply->set_next_page_token(EncodePageToken({start.incarnation, to, std::move(next)}, question));
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
