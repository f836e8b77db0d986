// SPDX-License-Identifier: Apache-2.0
// What tells two deltas apart that bear the same session and sequence.
#pragma once

#include <cstdint>

#include "schema/model/graph_delta.h"

namespace dsg {

/// XXH3 of all that a delta writes, before it is coalesced: two deltas with different content have
/// different checksums, but for one pair in 2^64. Where it is sent and how it is to be committed
/// (map, parent revision, is_forgetting) does not count.
/// Cost: a read of the delta; some nanoseconds a pose. Detects accidents, not forgery.
int64_t DeltaChecksum(const GraphDelta& delta);

}  // namespace dsg
