// SPDX-License-Identifier: Apache-2.0
// One person's whole life in a log: where the body is, how its joints are bent, what it holds.
// Refuses to depend on frame rates: every instant can be asked, in any order.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ingest/sensor/human_detection.h"
#include "ingest/simulator/body/body_model.h"
#include "ingest/simulator/world/planner.h"
#include "ingest/simulator/world/world.h"
#include "schema/base/time.h"

namespace dsg::simulator {

/// A person took an object, and put it down somewhere or still carries it at the end.
struct PickEvent {
  /// Index in World::furniture.
  int object = 0;
  /// Index of the person, 0 to count - 1.
  int person = 0;
  /// The hand touches the object; from here on it moves with the hand.
  TimeNs pick_ns = 0;
  /// kTimeMax if it is not put down before the end.
  TimeNs place_ns = kTimeMax;
  /// Room in which it was taken.
  int room = 0;
  /// kLeftHand or kRightHand.
  int hand_joint = 0;
  /// Where it stands afterwards; meaningful if place_ns is not kTimeMax.
  Pose3d map_T_object_after;
};

/// A body at one instant, map frame.
struct BodyState {
  /// Pelvis, x forward, z up.
  Pose3d map_T_torso;
  Posture pose;
  std::array<Eigen::Vector3d, ingest::kJointCount> joints_map;
};

struct CrowdMotionOptions {
  int people_count = 3;
  double duration_s = 25.0;
  /// Upper bound; 0 = none. Without one, a log gets an event for every 45 s of somebody's life, but
  /// at most 18 in five minutes, which some people do not manage in time.
  int pick_count_max = 20;
  /// Where the robot is on the floor, if people shall make way for it as for each other.
  std::function<Point(TimeNs)> robot_at;
  /// How many of the people's goals are in the robot's room, 0 to 1, so that a short log shows
  /// people at all.
  double meet_share = 0.5;
};

/// All people of a log. Times count from the start of the log.
///
/// People are planned one after the other. Each is a function of the seed, its index and those
/// before it: it takes another goal, or waits, where it would come within half a metre of one of
/// them, but gives up after eight tries, so two bodies may still pass through each other now and
/// then (below 0.5 % of the time even with 60 people in the office). An object is taken once.
///
/// Threads: safe; immutable once made.
class CrowdMotion {
 public:
  /// Same world, options and seed, same motion, also on another machine with the same build.
  /// `world` must outlive the result.
  static std::unique_ptr<CrowdMotion> Make(const World* world, const CrowdMotionOptions& options,
                                           uint64_t seed);
  virtual ~CrowdMotion() = default;

  virtual int count() const = 0;
  /// "alice", "person-27".
  virtual const std::string& name(int person) const = 0;
  virtual const BodyModel& body(int person) const = 0;
  /// Requires: 0 <= time_ns <= duration.
  virtual BodyState StateAt(int person, TimeNs time_ns) const = 0;
  /// Ascending by pick_ns.
  virtual const std::vector<PickEvent>& picks() const = 0;
  /// Where an object that may be carried is at an instant; its pose in World otherwise.
  virtual Pose3d ObjectPoseAt(int object, TimeNs time_ns) const = 0;
  /// Objects that somebody takes; ascending.
  virtual const std::vector<int>& movable() const = 0;
};

}  // namespace dsg::simulator
