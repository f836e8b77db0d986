// SPDX-License-Identifier: Apache-2.0
// What a mapper gets to know of a building in which people take things, as numbers, and what can
// be seen from where. Refuses to draw images: lines of sight against boxes and bodies decide.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/simulator/world/world.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::eval {

/// How much evidence there is.
enum class Tier {
  /// A camera in each room looks all day long.
  kCameras = 1,
  /// The same cameras look for 3 s, and away for up to 10 s.
  kGlances = 2,
  /// One robot walks through all rooms.
  kRobot = 3,
};

/// Errors and losses of a mapper of ours. Standard deviations on each axis unless they say so.
struct PickSensorModel {
  /// Keyframes. Source: default of dsg-simulate sensors.
  TimeNs frame_ns = kNsPerSecond / 5;

  /// Torsos placed with depth are off by 0.06 m in the mean; tracks are smooth, so the error stays
  /// for a while. Hands err as the simulated detector's joints do: 6 cm and, hidden, 25 cm more.
  double torso_sigma_m = 0.04;
  double torso_memory_s = 2.0;
  /// A person of whom less is seen is not found; and others neither with this probability.
  double visibility_min = 0.25;
  double miss_probability = 0.1;
  double person_range_m = 12.0;
  /// As of dsg-simulate tracks.
  double loss_per_min = 0.2;
  double loss_s_min = 3.0;
  double loss_s_max = 20.0;
  /// Seen again after two seconds, a person keeps its track with this probability.
  double found_again_probability = 0.85;
  /// Two who come this near to each other change tracks with this probability.
  double swap_m = 0.6;
  double swap_probability = 0.05;

  /// Small things that the mapper never makes an object of, and mapped ones that it believes gone
  /// once though they are there; most of these appear again.
  double never_mapped_probability = 0.35;
  double false_change_probability = 0.05;
  double reappear_probability = 0.7;
  /// A thing of the same class stands beside it, so far away.
  double twin_probability = 0.3;
  double twin_m_min = 0.15;
  double twin_m_max = 0.3;
  double object_sigma_m = 0.05;
  double size_factor_min = 0.7;
  double size_factor_max = 1.6;
  /// Of a robot's camera, for things of 10 cm.
  double object_range_m = 5.0;
  /// Pictures until a thing is believed there, and gone. Source: ingest/objects/object_watch.h.
  int present_count_min = 5;
  int absent_count_min = 5;
  /// The mapper tells what is new so often.
  TimeNs update_ns = 5 * kNsPerSecond;

  /// Tier 2: looks and pauses between them.
  double glance_s = 3.0;
  double pause_s_min = 3.0;
  double pause_s_max = 10.0;
};

/// A body as something that stands in the way.
struct Blocker {
  Eigen::Vector2d at_map = Eigen::Vector2d::Zero();
  double radius_m = 0.2;
  double height_m = 1.7;
};

/// Lines of sight past walls, furniture and bodies; glass hides nothing.
class SightLines {
 public:
  explicit SightLines(const simulator::World& world);

  /// Looks from here until the next call; farther things than `range_m` are no longer thought of.
  void StandAt(const Eigen::Vector3d& eye_map, double range_m);
  /// What `to_map` is part of, or in, does not hide it; `own` = index of a body left out, or -1.
  bool IsClear(const Eigen::Vector3d& to_map, const std::vector<Blocker>& bodies, int own) const;

 private:
  std::vector<Box3d> boxes_;
  Eigen::Vector3d eye_map_ = Eigen::Vector3d::Zero();
  std::vector<Box3d> near_;
};

}  // namespace dsg::eval
