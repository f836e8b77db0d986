// SPDX-License-Identifier: Apache-2.0
// How much of an interval anybody was observed in. Refuses to count gaps.
#pragma once

#include "absl/status/statusor.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// 0 to 1: the union of all tracks without their gaps. An observed robot observes objects.
/// Cost: the poses of as many tracks as it takes to cover the interval, robots first.
absl::StatusOr<double> ObservedShare(const Snapshot& snapshot, const Interval& during,
                                     const StopCheck& stop);

}  // namespace dsg::query
