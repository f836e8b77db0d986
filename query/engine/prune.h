// SPDX-License-Identifier: Apache-2.0
// Forgetting by policy, a batch a message.
// Refuses to forget all of a map unless it is told that it may.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

/// The first message says what will go; the others that a batch of it is gone and on disk. Commits
/// of others go in between; what they change meanwhile is left as it is, but where it is to be
/// erased: there its past goes, and what cannot go is named. A prune that ended early is gone on
/// with by asking for the same again; the map itself knows what an erasure has left.
///
/// Errors: MAP_UNKNOWN, FIELD_INVALID, BOX_INVERTED, NUMBER_NOT_FINITE; in the stream NODE_UNKNOWN,
/// LAYER_UNKNOWN, POLICY_MATCHES_ALL, POLICY_TAKES_TOO_MUCH,
/// REVISION_IN_FUTURE, WRITER_LOCKED, DISK_FULL.
absl::StatusOr<std::unique_ptr<PruneCursor>> OpenPrune(MapTable* maps,
                                                       const v1::PruneRequest& request);

}  // namespace dsg::query
