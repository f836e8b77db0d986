// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/pose_thinning.h"

namespace dsg {

std::vector<TimedPose> ThinPoses(const std::vector<TimedPose>& poses, const PoseStep& step,
                                 TimeNs gap_ns_max) {
  if (step.distance_m <= 0.0) return poses;
  std::vector<TimedPose> kept;
  for (size_t i = 0; i < poses.size(); ++i) {
    const TimedPose& pose = poses[i];
    const bool is_end = i == 0 || i + 1 == poses.size() ||
                        pose.time_ns - poses[i - 1].time_ns > gap_ns_max ||
                        poses[i + 1].time_ns - pose.time_ns > gap_ns_max;
    const bool is_wanted =
        is_end || pose.time_ns - kept.back().time_ns >= step.time_ns ||
        (pose.map_T_agent.position - kept.back().map_T_agent.position).norm() >= step.distance_m;
    if (is_wanted) kept.push_back(pose);
  }
  return kept;
}

}  // namespace dsg
