// SPDX-License-Identifier: Apache-2.0
// People who walk between random points of a building and pause there, as noisy tracks in time
// order: the same numbers for the same seed, so that every store under test gets the same poses.
// Refuses to plan around walls: a store does not care, and planning would cost more than storing.
#pragma once

#include <cstdint>
#include <vector>

#include "schema/base/random.h"
#include "schema/model/graph_delta.h"

namespace dsg::bench {

/// Extent of the building, metres; floors are kFloorHeightM apart.
inline constexpr double kBuildingXM = 80.0;
inline constexpr double kBuildingYM = 60.0;
inline constexpr double kFloorHeightM = 3.0;
inline constexpr int kFloorCount = 3;

/// 10 Hz.
inline constexpr TimeNs kPosePeriodNs = kNsPerSecond / 10;
inline constexpr TimeNs kCrowdEpochNs = 1'700'000'000 * kNsPerSecond;

/// Agent `index` of a crowd.
NodeId CrowdAgent(int index);

/// Makes the poses of one agent: 3 mm and 4 mrad of Gaussian noise, 0.5 ms of clock jitter, stamps
/// in whole microseconds.
class Walker {
 public:
  Walker(uint64_t seed, int index);
  TimedPose Next();

 private:
  void Advance();
  void ChooseGoal();

  Random random_;
  int64_t step_ = 0;
  Eigen::Vector3d position_;
  Eigen::Vector3d goal_;
  double yaw_ = 0.0;
  double speed_m_per_s_ = 1.0;
  int64_t pause_steps_ = 0;
};

class Crowd {
 public:
  Crowd(uint64_t seed, int agent_count);
  /// The agents as nodes, without poses.
  std::vector<Node> Nodes() const;
  /// The next poses of every agent, `pose_count` each.
  std::vector<TrajectoryAppend> Next(int pose_count);

 private:
  std::vector<Walker> walkers_;
};

}  // namespace dsg::bench
