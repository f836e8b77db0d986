// SPDX-License-Identifier: Apache-2.0
// Answers ListNodeVersions: what was believed of one node.
#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Whether a revision that can be read shows the version.
bool IsReadable(const NodeVersion& version, Revision oldest, const std::vector<Tag>& tags) {
  return version.to > oldest || std::any_of(tags.begin(), tags.end(), [&](const Tag& tag) {
           return version.from <= tag.revision && tag.revision < version.to;
         });
}

// Where the next page begins: below this revision. 0 = with the newest version.
absl::StatusOr<Revision> BeginOf(const Page& page) {
  if (page.is_first()) return Revision{0};
  std::string_view position = page.position;
  uint64_t word = 0;
  if (!TakeWord(&position, &word) || !position.empty()) return PageTokenError();
  return static_cast<Revision>(word);
}

std::string VersionPosition(Revision from) {
  std::string position;
  AppendWord(static_cast<uint64_t>(from), &position);
  return position;
}

}  // namespace

absl::Status ListNodeVersions(Engine* engine, const CallContext& call,
                              const v1::ListNodeVersionsRequest& request,
                              v1::ListNodeVersionsResponse* reply) {
  DSG_RETURN_IF_ERROR(CheckNodeView(request.view()));
  DSG_ASSIGN_OR_RETURN(const NodeId id, ParseNodeId(request.id()));
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListNodeVersions", request));
  DSG_ASSIGN_OR_RETURN(Revision before, BeginOf(page));
  MapReader& map = page.view.map();
  DSG_ASSIGN_OR_RETURN(const Revision oldest, map.OldestRevision());
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, map.Tags());
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, LayersOf(page.view.snapshot()));
  page.view.FillHeader(reply->mutable_header());
  size_t bytes = 0;
  for (;;) {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const auto versions, map.NodeVersions(id, before, kPageSizeDefault));
    for (const NodeVersion& version : versions) {
      if (!IsReadable(version, oldest, tags)) continue;
      if (reply->versions_size() == page.size || bytes > kPageBytesSoftMax) {
        reply->set_next_page_token(page.NextToken(VersionPosition(before)));
        return absl::OkStatus();
      }
      v1::NodeVersion* out = reply->add_versions();
      out->set_from_revision(version.from);
      if (version.to != kRevisionMax) out->set_to_revision(version.to);
      FillNode(version.node, layers, request.view(), out->mutable_node());
      bytes += out->ByteSizeLong();
      before = version.from;
    }
    if (std::ssize(versions) < kPageSizeDefault) break;
    before = versions.back().from;
  }
  if (page.is_first() && reply->versions().empty()) {
    return MakeError(Reason::kNodeUnknown,
                     absl::StrCat("no readable revision of map \"", request.map(), "\" has a node ",
                                  request.id(), "; the oldest is ", oldest),
                     {{"map", request.map()}, {"node", request.id()}});
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
