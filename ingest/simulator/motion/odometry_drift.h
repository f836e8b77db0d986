// SPDX-License-Identifier: Apache-2.0
// What odometry would say of a robot's way, and loop closures that right it again, wrong ones too.
// Refuses to be exact: its errors are drawn, by seed.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

struct StampedPose {
  TimeNs time_ns = 0;
  Pose3d map_T_body;
};

struct DriftOptions {
  uint64_t seed = 1;
  /// A random walk: so large a standard deviation on each axis, and about the vertical, after one
  /// metre, and twice that after four. Gravity keeps the robot level.
  double drift_m_per_m = 0.02;
  double drift_rad_per_m = 0.005;
  /// A loop closure is found at most so often...
  TimeNs loop_period_ns = 10 * kNsPerSecond;
  /// ...when the robot is as near as this to where it was at least so long ago...
  double loop_range_m = 2.0;
  double loop_turn_rad = 1.047;
  TimeNs loop_age_ns = 10 * kNsPerSecond;
  /// ...and has been on a way of at least this since.
  double loop_way_m = 4.0;
  /// Standard deviations on each axis.
  double loop_sigma_m = 0.05;
  double loop_sigma_rad = 0.01745;
  /// Share of wrong ones among all loop closures, 0 to 0.95.
  double wrong_share = 0.0;

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID.
  absl::Status Validate() const;
};

/// The true poses as odometry adds them up, beginning at the first true one.
std::vector<StampedPose> AddDrift(const std::vector<StampedPose>& truth,
                                  const DriftOptions& options);

struct SimulatedLoop {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Pose3d from_T_to;
  /// False for one that mixes up two places.
  bool is_right = true;
};

/// Ascending by to_ns, then from_ns. Requires: times strictly grow.
std::vector<SimulatedLoop> DrawLoops(const std::vector<StampedPose>& truth,
                                     const DriftOptions& options);

}  // namespace dsg::simulator
