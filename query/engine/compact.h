// SPDX-License-Identifier: Apache-2.0
// Old revisions dropped and their bytes given back, a slice of time a message.
// Refuses to keep commits waiting until all is done.
#pragma once

#include "query/api/api.h"
#include "query/engine/map_table.h"

namespace dsg::query {

/// Compact for callers inside the engine. Errors: MAP_UNKNOWN, FIELD_INVALID; in the stream those
/// of MapWriter::Compact.
CursorOr<v1::CompactResponse> OpenCompact(MapTable* maps, const v1::CompactRequest& request);

}  // namespace dsg::query
