// SPDX-License-Identifier: Apache-2.0
// Fewer poses that tell the same way, for formats that keep each pose as a node.
// Refuses to drop the ends of a track, or of its gaps.
#pragma once

#include <vector>

#include "schema/model/trajectory.h"

namespace dsg {

struct PoseStep {
  /// A pose this far from the last one kept is kept; 0 = every pose.
  double distance_m = 0.5;
  /// And one this much later.
  TimeNs time_ns = kNsPerSecond;
};

std::vector<TimedPose> ThinPoses(const std::vector<TimedPose>& poses, const PoseStep& step,
                                 TimeNs gap_ns_max);

}  // namespace dsg
