// SPDX-License-Identifier: Apache-2.0
// Old revisions dropped and their bytes given back, a slice of time a message.
// Refuses to keep commits waiting until all is done.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

/// Errors: MAP_UNKNOWN, FIELD_INVALID; in the stream those of MapWriter::Compact.
absl::StatusOr<std::unique_ptr<CompactCursor>> OpenCompact(MapTable* maps,
                                                           const v1::CompactRequest& request);

}  // namespace dsg::query
