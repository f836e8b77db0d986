// SPDX-License-Identifier: Apache-2.0
// Which instants a map can hold poses of.
// Refuses to say what an instant means: that is the map's clock.
#pragma once

#include "absl/status/status.h"
#include "schema/base/time.h"
#include "schema/model/layer.h"

namespace dsg {

/// Tracks are found by tenths of a second from the map's epoch, in 32 bits: 6.8 years either way.
/// Errors: OUT_OF_RANGE/TIME_OUTSIDE_MAP.
absl::Status CheckTimeInMap(TimeNs time_ns, const MapSpec& spec);

}  // namespace dsg
