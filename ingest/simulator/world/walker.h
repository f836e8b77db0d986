// SPDX-License-Identifier: Apache-2.0
// One agent's life: it stays somewhere for a while, then walks to the next goal, without end.
// Refuses to see others: walkers pass through each other, so that each is a function of its seed
// and index alone and can be replayed by whoever needs it again.
#pragma once

#include <string>
#include <vector>

#include "ingest/simulator/world/planner.h"
#include "schema/base/random.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

struct AgentSpec {
  /// Unique: "alice", "person-27", "robot".
  std::string name;
  bool is_robot = false;
  /// The walker's own stream of random numbers.
  int index = 0;
};

/// The robot and `people_count` people, ascending by name.
std::vector<AgentSpec> MakeCrowd(int people_count);

/// Where an agent stands, on the floor's plane.
struct FloorPose {
  Point position = Point::Zero();
  /// Radians from the x axis to the left, in [-pi, pi].
  double yaw = 0.0;
};

/// A stay and the walk after it. Times count from the start of the simulation.
struct Leg {
  /// [begin_ns, depart_ns) at the path's first point, [depart_ns, end_ns) on the path.
  TimeNs begin_ns = 0;
  TimeNs depart_ns = 0;
  TimeNs end_ns = 0;
  Goal start;
  Goal goal;
  Path path;
  SpeedProfile profile;
  double yaw_begin = 0.0;
  /// At departure; the agent turns to it while it still stands.
  double yaw_depart = 0.0;

  FloorPose PoseAt(TimeNs time_ns) const;
};

/// Threads: one caller at a time.
class Walker {
 public:
  /// `world` and `planner` must outlive the walker.
  Walker(const World* world, const Planner* planner, const AgentSpec& agent, uint64_t seed);

  const Leg& leg() const { return leg_; }
  void NextLeg();
  /// Requires: times never go back, apart from within one leg.
  FloorPose PoseAt(TimeNs time_ns);

 private:
  void PlanLeg(TimeNs begin_ns, const Goal& start, double yaw_begin);
  int NextGoalPlace();
  int DrawPlaceIn(int room);

  const World& world_;
  const Planner& planner_;
  const bool is_robot_;
  Random random_;
  /// Places inside each room, doorways left out.
  std::vector<std::vector<int>> room_places_;
  /// Rooms to stay in; the robot visits them in turn.
  std::vector<int> tour_;
  size_t tour_next_ = 0;
  int home_room_ = 0;
  double cruise_m_s_ = 1.0;
  Leg leg_;
};

/// Position on the agent's body and orientation, map frame.
Pose3d BodyPose(const FloorPose& pose, bool is_robot);

}  // namespace dsg::simulator
