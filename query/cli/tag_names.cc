// SPDX-License-Identifier: Apache-2.0
#include "query/cli/tag_names.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "schema/base/status.h"
#include "schema/store/tags.h"

namespace dsg::cli {

absl::StatusOr<v1::ListTagsResponse> ReadTags(Session* session) {
  v1::ListTagsRequest request;
  request.set_map(session->map().name);
  v1::ListTagsResponse reply;
  const absl::Status status = session->api().ListTags(session->NewCall(), request, &reply);
  if (!absl::IsUnimplemented(status)) DSG_RETURN_IF_ERROR(status);
  return reply;
}

absl::StatusOr<std::optional<Revision>> NumberOf(const RevisionOption& revision, Session* session) {
  if (revision.tag.empty()) return revision.number;
  DSG_ASSIGN_OR_RETURN(const v1::ListTagsResponse reply, ReadTags(session));
  std::vector<Tag> tags;
  for (const v1::Tag& tag : reply.tags()) {
    if (tag.name() == revision.tag) return std::optional<Revision>(tag.revision());
    tags.emplace_back().name = tag.name();
  }
  const std::string& map = session->map().name;
  return MakeError(
      Reason::kTagUnknown,
      absl::StrCat("map \"", map, "\" has no tag \"", revision.tag, "\"; it has ", TagNames(tags)),
      {{"map", map}, {"tag", revision.tag}});
}

}  // namespace dsg::cli
