// SPDX-License-Identifier: Apache-2.0
// What a tag on the command line stands for. Refuses to guess: the map is asked.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "query/cli/options_keep.h"
#include "query/cli/session.h"
#include "schema/model/revision.h"

namespace dsg::v1 {
class ListTagsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// The number of the revision, if one was given. Requires: the session's map is chosen.
/// Errors: NOT_FOUND/TAG_UNKNOWN.
absl::StatusOr<std::optional<Revision>> NumberOf(const RevisionOption& revision, Session* session);

/// The tags of the session's map; none from a server that knows of no tags.
absl::StatusOr<v1::ListTagsResponse> ReadTags(Session* session);

}  // namespace dsg::cli
