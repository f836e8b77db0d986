// SPDX-License-Identifier: Apache-2.0
// The revisions of a map as they come, from where the caller left off.
// Refuses to keep a thread while nothing happens.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

/// Errors: MAP_UNKNOWN, REVISION_IN_FUTURE, REVISION_COMPACTED, FIELD_INVALID.
absl::StatusOr<std::unique_ptr<WatchCursor>> OpenWatch(MapTable* maps,
                                                       const v1::WatchMapRequest& request);

}  // namespace dsg::query
