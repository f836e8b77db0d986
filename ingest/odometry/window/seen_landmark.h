// SPDX-License-Identifier: Apache-2.0
// A landmark as the window of keyframes knows it, for those who use it beside the estimate.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace dsg::ingest {

struct SeenLandmark {
  /// The tracker's; a feature that is followed for longer than the window becomes a new landmark of
  /// the same id.
  int64_t feature_id = 0;
  /// In the odometry frame, metres, as it is estimated by now.
  Eigen::Vector3d position_odom = Eigen::Vector3d::Zero();
  /// Where the newest keyframe sees it, in the rectified left image; unset if it does not.
  std::optional<Eigen::Vector2d> pixel;
  /// Keyframes of the window that have seen it.
  int sight_count = 0;
};

}  // namespace dsg::ingest
