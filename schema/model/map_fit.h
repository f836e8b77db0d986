// SPDX-License-Identifier: Apache-2.0
// Whether a delta can be of the map that it is for: its times and places are near what the map
// holds. What a delta says of itself is checked in delta_check.h.
#pragma once

#include "absl/status/status.h"
#include "schema/model/delta_check.h"

namespace dsg {

/// Nothing is refused of a graph that tells no spec.
/// Errors: INVALID_ARGUMENT/TIME_IMPLAUSIBLE for times too far from all that the map knows;
/// DELTA_INVALID for vertices outside of their mesh block.
absl::Status CheckFitsMap(const GraphDelta& delta, const GraphLookup& graph);

}  // namespace dsg
