// SPDX-License-Identifier: Apache-2.0
// Makes up a person's life: walks to random goals, pauses, errands to take and bring things.
// Refuses to plan two people at once: each one sees those before it.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "ingest/simulator/body/errand_board.h"
#include "ingest/simulator/body/human_motion.h"
#include "ingest/simulator/body/life.h"
#include "ingest/simulator/body/traffic.h"

namespace dsg::simulator {

/// What all planners of a log share; outlives them.
struct LifeStage {
  const World* world = nullptr;
  const Planner* planner = nullptr;
  ErrandBoard* board = nullptr;
  const Traffic* traffic = nullptr;
  /// Where the robot is; may be empty.
  std::function<Point(TimeNs)> robot_at;
  /// How many of the goals are near it.
  double meet_share = 0.0;
  double duration_s = 0.0;
  uint64_t seed = 0;
};

struct PlannedLife {
  Life life;
  std::vector<PickEvent> picks;
};

/// One life from start to end.
class LifePlanner {
 public:
  LifePlanner(const LifeStage& stage, int person, const BodyModel* body);

  /// `errand_times_s` ascending: at each the person turns to an errand, or soon after.
  PlannedLife Plan(const std::vector<double>& errand_times_s);

 private:
  void Start(const std::vector<double>& errand_times_s);
  std::optional<ObjectChoice> TakeFirstObject();
  void StandFor(double seconds);
  void TurnTo(double yaw);
  void AddReach(const ReachStand& stand);
  void DoErrand();
  void BringAway(PickEvent pick);
  void StrollAfter(double pause_s);
  void WalkTo(const Goal& goal);
  void Follow(const Walk& walk, const Goal& goal);
  Walk PlanWalk(const Goal& goal);
  int Touches(const Walk& walk, double wait_s, double stay_s) const;
  Goal DrawGoalAround(const Point& center);
  Goal DrawNextGoal();
  /// Nothing where there is no robot, or no place near it.
  std::optional<Goal> DrawGoalNearRobot(double from_s, double to_s);
  std::optional<Goal> DrawGoalInRoomOf(const ReachStand& stand);
  bool IsOver() const { return now_ns_ > NsOf(stage_.duration_s); }

  const LifeStage stage_;
  const int person_;
  const BodyModel& body_;
  Random random_;
  double cruise_m_s_ = 1.2;
  TimeNs now_ns_ = 0;
  Goal at_;
  double yaw_ = 0.0;
  /// It takes and carries things.
  Side hand_ = Side::kRight;
  /// An object chosen before the start, so that the person begins near it.
  std::optional<ObjectChoice> first_;
  bool hands_full_ = false;
  PlannedLife out_;
};

}  // namespace dsg::simulator
