// SPDX-License-Identifier: Apache-2.0
// The cameras of a tier: in the corner of each room, or on a robot, and when they look.
// Refuses to know people's names and objects' names; it answers what is in the picture.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "ingest/simulator/motion/robot_motion.h"
#include "schema/base/random.h"
#include "tests/eval/pick_sensor.h"

namespace dsg::eval {

/// Threads: one caller at a time.
class Cameras {
 public:
  /// `robot`: null unless the tier has one. Both must outlive this.
  Cameras(const simulator::World& world, const simulator::RobotMotion* robot, Tier tier,
          const PickSensorModel& sensor, double duration_s, uint64_t seed);

  /// From now on it is then. Requires: times never go back.
  void SetTime(TimeNs at_ns);
  /// Whether some camera looks at a point in that room, bodies or not.
  bool Sees(int room, const Eigen::Vector3d& point_map, double range_m,
            const std::vector<Blocker>& bodies, int own) const;

 private:
  struct Corner {
    SightLines sight;
    /// Begins and ends of looks, ascending; empty = always.
    std::vector<TimeNs> turns_ns;
    bool is_looking = true;
  };

  void AddCorner(const simulator::World& world, int room);
  void DrawGlances(const PickSensorModel& sensor, double duration_s, Random* random);

  const simulator::RobotMotion* robot_;
  std::vector<Corner> corners_;
  std::optional<SightLines> robot_sight_;
  Pose3d map_T_camera_;
};

}  // namespace dsg::eval
