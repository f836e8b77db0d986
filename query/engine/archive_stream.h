// SPDX-License-Identifier: Apache-2.0
// A map as the bytes of an archive. Refuses to hold any lock on the map while they are read, and
// to go on with bytes that were erased from the map since.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

/// The first message takes as long as copying the map does.
/// Errors: MAP_UNKNOWN; OVERLOADED; in the stream also DISK_FULL, and MAP_REPLACED once the map was
/// erased from.
absl::StatusOr<std::unique_ptr<ArchiveCursor>> OpenArchive(MapTable* maps,
                                                           const v1::ReadArchiveRequest& request);

}  // namespace dsg::query
