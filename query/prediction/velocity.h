// SPDX-License-Identifier: Apache-2.0
// Observed paths as predictions want them, how fast someone walks, and where they will be if they
// walk on like that. Paths come as plain numbers: predictions know no stores and no requests.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "schema/base/time.h"

namespace dsg::query {

/// A position that was observed. Ascending in time.
struct PathPoint {
  TimeNs time_ns = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
};

/// Metres per second.
struct Velocity {
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
  /// From how many steps; 0 = nothing known, and zero.
  int step_count = 0;
};

/// Of the last step alone. Points of one time are one point, the last of them.
/// Source: Schoeller et al. 2020 (constant velocity).
/// Requires, as everything here: finite positions, times that never go back.
Velocity LastVelocity(const std::vector<PathPoint>& path);

/// Of at most the last seven steps, the last one counts most: weight decay^age.
/// Requires: `decay` from 0 (the last step alone) to 1 (all alike).
Velocity SmoothedVelocity(const std::vector<PathPoint>& path, double decay);

/// One possible future.
struct PredictedPath {
  double probability = 1.0;
  /// At the asked times.
  std::vector<Eigen::Vector3d> positions_map;
  /// Standard deviation of each position, metres, on each axis.
  std::vector<double> sigma_m;
  /// Of a GoalField, the likeliest that it leads to; -1 = none.
  int goal = -1;
};

struct ConstantVelocityOptions {
  /// Of SmoothedVelocity; 0 = the last step alone.
  double decay = 0.0;
  /// The velocity shrinks by this factor a second; 1 = constant.
  double damping = 1.0;
  /// Growth of the standard deviation, m / s.
  double sigma_m_s = 0.25;
};

/// Someone of one point stands still.
/// Requires: at least one point; `at_ns` ascending, not before the last point.
PredictedPath PredictConstantVelocity(const std::vector<PathPoint>& path,
                                      const std::vector<TimeNs>& at_ns,
                                      const ConstantVelocityOptions& options);

/// How PredictWeightedVelocity smooths and damps, for tracks that go straight or turn, and for
/// those that zigzag as noise of detections makes them. Found on recorded pedestrians (Pellegrini
/// et al. 2009, Lerner et al. 2007), see tests/unit/query/prediction/eth_ucy_test.cc. These numbers
/// hold when each scene is left out in turn; but what counts as zigzag and as rough was set with
/// all scenes in view, so that figures on them are kinder than a new place would be.
struct WeightedVelocityOptions {
  double decay_steady = 0.05;
  double decay_noisy = 0.5;
  /// The velocity shrinks by this factor every 0.4 s.
  double damping_steady = 0.99;
  double damping_noisy = 0.97;
  double sigma_m_s = 0.25;
};

/// Constant velocity that is smoothed over the last seven steps and damped, both the more the more
/// the last steps zigzag: noise of positions turns back what it did a step ago, people hardly do.
/// Requires: as PredictConstantVelocity; steps should be even.
PredictedPath PredictWeightedVelocity(const std::vector<PathPoint>& path,
                                      const std::vector<TimeNs>& at_ns,
                                      const WeightedVelocityOptions& options);

/// Finite positions, times that never go back.
void CheckPath(const std::vector<PathPoint>& path);

/// At least one point, and `at_ns` ascending from there.
void CheckPathAndTimes(const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns);

/// From the last point of the path.
double SecondsAhead(const std::vector<PathPoint>& path, TimeNs at_ns);

/// The step that people's velocities are taken over; shorter ones are noise of detections.
inline constexpr TimeNs kTrackStepNs = 400'000'000;
/// What is looked at of a track.
inline constexpr TimeNs kTrackSeenNs = 8'000'000'000;

/// Points every kTrackStepNs back from the last pose, linear between poses, over at most
/// kTrackSeenNs and no gap longer than `gap_ns_max`. Of a track of less than one step its first
/// pose too, if that is half a step old.
/// Requires: ascending times.
std::vector<PathPoint> RecentTrack(const std::vector<PathPoint>& poses, TimeNs gap_ns_max);

}  // namespace dsg::query
