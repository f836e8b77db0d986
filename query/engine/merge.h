// SPDX-License-Identifier: Apache-2.0
// Another map taken into this one, a batch a message.
// Refuses to guess a transform that the maps do not tell.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

/// The first message has the transform and what will become of the nodes, as counts; then each has
/// one more batch on disk, and the last ones the ids.
/// Errors: MAP_UNKNOWN, FIELD_INVALID; in the stream FRAMES_INCOMPATIBLE, NO_REGISTRATION,
/// WRITER_LOCKED, and PARENT_REVISION_STALE when somebody else commits to the map meanwhile: the
/// same call again does the rest.
absl::StatusOr<std::unique_ptr<MergeCursor>> OpenMerge(MapTable* maps,
                                                       const v1::MergeMapsRequest& request);

}  // namespace dsg::query
