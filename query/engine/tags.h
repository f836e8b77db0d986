// SPDX-License-Identifier: Apache-2.0
// Names for revisions: set, taken away, listed, and understood where a revision is meant.
// Refuses to guess: a name that no revision has is an error that lists those there are.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "query/engine/call_context.h"
#include "query/engine/map_table.h"

namespace dsg::v1 {
class ListTagsRequest;
class ListTagsResponse;
class RemoveTagRequest;
class SetTagRequest;
class SetTagResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status SetTag(MapTable* maps, const CallContext& call, const v1::SetTagRequest& request,
                    v1::SetTagResponse* reply);
absl::Status RemoveTag(MapTable* maps, const CallContext& call,
                       const v1::RemoveTagRequest& request);
absl::Status ListTags(MapTable* maps, const v1::ListTagsRequest& request,
                      v1::ListTagsResponse* reply);

/// Errors: NOT_FOUND/TAG_UNKNOWN.
absl::StatusOr<Revision> RevisionOfTag(MapReader* map, const std::string& tag);

}  // namespace dsg::query
