// SPDX-License-Identifier: Apache-2.0
// Names for revisions: set, taken away, listed, and understood where a revision is meant.
// Refuses to guess: a name that no revision has is an error that lists those there are.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

/// Errors: NOT_FOUND/TAG_UNKNOWN.
absl::StatusOr<Revision> RevisionOfTag(MapReader* map, const std::string& tag);

}  // namespace dsg::query
