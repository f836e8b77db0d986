// SPDX-License-Identifier: Apache-2.0
// Which instants a map can hold poses of. What an instant means is said by the map's clock.
#pragma once

#include "absl/status/status.h"
#include "schema/base/time.h"
#include "schema/model/graph_delta.h"
#include "schema/model/layer.h"

namespace dsg {

/// Poses lie no further from the epoch of their map, before or after it: 68 years. What lies beyond
/// is a wrong clock, and sums of such times need not fit 64 bits.
inline constexpr int64_t kFromEpochYearsMax = 68;

/// Errors: OUT_OF_RANGE/TIME_OUTSIDE_MAP.
absl::Status CheckTimeInMap(TimeNs time_ns, const MapSpec& spec);

/// The same for all poses that a delta brings. Requires: those of an agent ascend in time.
absl::Status CheckPosesInMap(const GraphDelta& delta, const MapSpec& spec);

}  // namespace dsg
