// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/life_planner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::simulator {
namespace {

constexpr uint64_t kLifeStream = uint64_t{3} << 32;
constexpr double kGoalRangeM = 25.0;
constexpr double kGoalNearM = 2.5;
constexpr int kGoalTries = 20;
constexpr int kWalkTries = 8;
constexpr double kWaitStepS = 1.5;
/// Somebody with an errand before this begins in the room of the object.
constexpr double kEarlyErrandS = 15.0;
constexpr double kEarlyRangeM = 3.5;
/// Some carry what they took until the end.
constexpr double kKeepProbability = 0.12;
constexpr double kCarryRangeM = 25.0;
/// A way along corridors is longer than the straight line; metres a second of that line.
constexpr double kStraightMps = 0.6;
/// Of each errand, however near.
constexpr double kTurnAndReachS = 6.0;
constexpr double kCarryNearM = 3.0;
constexpr double kLeftHanded = 0.12;
constexpr double kStandMinS = 0.05;
/// A goal near the robot is in its room and so far from it.
constexpr double kMeetNearM = 1.5;
constexpr double kMeetRangeM = 6.0;
/// Where the robot will be by then, for the goal of a walk and for the start.
constexpr double kMeetSoonS = 2.0;
constexpr double kMeetLateS = 12.0;
constexpr double kMeetStartS = 20.0;

}  // namespace

LifePlanner::LifePlanner(const LifeStage& stage, int person, const BodyModel* body)
    : stage_(stage),
      person_(person),
      body_(*body),
      random_(stage.seed, kLifeStream + static_cast<uint64_t>(person)) {}

Goal LifePlanner::DrawGoalAround(const Point& center) {
  const std::vector<Place>& places = stage_.world->places.places;
  int place = at_.place;
  for (int i = 0; i < kGoalTries; ++i) {
    place = random_.Index(static_cast<int>(places.size()));
    // Nobody stops in a doorway.
    if (places[place].door >= 0) continue;
    const double distance = (places[place].position - center).norm();
    if (distance >= kGoalNearM && distance <= kGoalRangeM) break;
  }
  return stage_.planner->DrawGoal(place, &random_);
}

std::optional<Goal> LifePlanner::DrawGoalNearRobot(double from_s, double to_s) {
  if (!stage_.robot_at || !random_.Chance(stage_.meet_share)) return std::nullopt;
  const double time_s = std::min(random_.Uniform(from_s, to_s), stage_.duration_s);
  const Point robot = stage_.robot_at(NsOf(time_s));
  const int room = stage_.world->plan.RoomAt(robot);
  const std::vector<Place>& places = stage_.world->places.places;
  std::vector<int> near;
  for (size_t i = 0; i < places.size(); ++i) {
    const double distance = (places[i].position - robot).norm();
    if (places[i].room == room && places[i].door < 0 && distance > kMeetNearM &&
        distance < kMeetRangeM) {
      near.push_back(static_cast<int>(i));
    }
  }
  if (near.empty()) return std::nullopt;
  return stage_.planner->DrawGoal(near[random_.Index(static_cast<int>(near.size()))], &random_);
}

Goal LifePlanner::DrawNextGoal() {
  const double now_s = SecondsOf(now_ns_);
  const std::optional<Goal> meeting = DrawGoalNearRobot(now_s + kMeetSoonS, now_s + kMeetLateS);
  return meeting.has_value() ? *meeting : DrawGoalAround(at_.position);
}

std::optional<Goal> LifePlanner::DrawGoalInRoomOf(const ReachStand& stand) {
  const std::vector<Place>& places = stage_.world->places.places;
  std::vector<int> near;
  for (size_t i = 0; i < places.size(); ++i) {
    const double distance = (places[i].position - stand.goal.position).norm();
    if (places[i].room == places[stand.goal.place].room && places[i].door < 0 &&
        distance < kEarlyRangeM && distance > 1.0) {
      near.push_back(static_cast<int>(i));
    }
  }
  if (near.empty()) return std::nullopt;
  return stage_.planner->DrawGoal(near[random_.Index(static_cast<int>(near.size()))], &random_);
}

std::optional<ObjectChoice> LifePlanner::TakeFirstObject() {
  if (!stage_.robot_at || !random_.Chance(stage_.meet_share)) {
    return stage_.board->TakeAnyObject(body_, hand_, &random_);
  }
  // Where the robot may see it being taken.
  const double time_s = std::min(random_.Uniform(kMeetSoonS, kEarlyErrandS), stage_.duration_s);
  return stage_.board->TakeObject(body_, hand_, stage_.robot_at(NsOf(time_s)), &random_);
}

void LifePlanner::Start(const std::vector<double>& errand_times_s) {
  cruise_m_s_ = random_.Uniform(1.0, 1.4);
  yaw_ = random_.Uniform(-std::numbers::pi, std::numbers::pi);
  hand_ = random_.Chance(kLeftHanded) ? Side::kLeft : Side::kRight;
  out_.life.idle_offset_s = random_.Uniform(0.0, 1000.0);
  if (!errand_times_s.empty() && errand_times_s.front() < kEarlyErrandS) {
    first_ = TakeFirstObject();
  }
  for (int i = 0; i < kWalkTries; ++i) {
    std::optional<Goal> start;
    if (first_.has_value()) {
      start = DrawGoalInRoomOf(first_->stand);
    } else {
      start = DrawGoalNearRobot(0.0, kMeetStartS);
    }
    const Rect bounds = stage_.world->Bounds();
    const Point anywhere(random_.Uniform(bounds.min().x(), bounds.max().x()),
                         random_.Uniform(bounds.min().y(), bounds.max().y()));
    at_ = start.has_value() ? *start : DrawGoalAround(anywhere);
    if (stage_.traffic->TouchesStanding(at_.position, 0, NsOf(5.0)) == 0) break;
  }
}

void LifePlanner::StandFor(double seconds) {
  LifeSegment segment;
  segment.begin_ns = now_ns_;
  segment.end_ns = now_ns_ + NsOf(std::max(seconds, kStandMinS));
  segment.position = at_.position;
  segment.yaw_begin = yaw_;
  segment.yaw_end = yaw_;
  now_ns_ = segment.end_ns;
  out_.life.segments.push_back(segment);
}

void LifePlanner::TurnTo(double yaw) {
  const double seconds = TurnDurationS(yaw_, yaw);
  if (seconds > 1e-3) {
    StandFor(seconds);
    out_.life.segments.back().yaw_end = yaw;
  }
  yaw_ = yaw;
}

Walk LifePlanner::PlanWalk(const Goal& goal) {
  const double speed = std::clamp(cruise_m_s_ + random_.Uniform(-0.15, 0.15), 0.9, 1.5);
  return Walk(stage_.planner->Plan(at_, goal, &random_), speed);
}

int LifePlanner::Touches(const Walk& walk, double wait_s, double stay_s) const {
  const TimeNs turned_ns = now_ns_ + NsOf(wait_s + TurnDurationS(yaw_, walk.path().HeadingAt(0.0)));
  const TimeNs end_ns = turned_ns + walk.duration_ns();
  const Point& goal = walk.path().points().back();
  return stage_.traffic->TouchesStanding(at_.position, now_ns_, turned_ns) +
         stage_.traffic->TouchesWalking(walk, turned_ns) +
         stage_.traffic->TouchesStanding(goal, end_ns, end_ns + NsOf(stay_s));
}

void LifePlanner::Follow(const Walk& walk, const Goal& goal) {
  TurnTo(walk.YawAt(0.0));
  LifeSegment segment;
  segment.begin_ns = now_ns_;
  segment.end_ns = now_ns_ + walk.duration_ns();
  segment.walks = true;
  segment.walk = walk;
  now_ns_ = segment.end_ns;
  yaw_ = walk.YawAt(SecondsOf(walk.duration_ns()));
  at_ = goal;
  out_.life.segments.push_back(std::move(segment));
}

void LifePlanner::WalkTo(const Goal& goal) {
  if ((goal.position - at_.position).norm() < 1e-3) return;
  // Whoever would run into somebody waits a little, or leaves as soon as it is least crowded.
  std::optional<Walk> best;
  double best_wait_s = 0.0;
  int best_touches = 0;
  for (int i = 0; i < kWalkTries; ++i) {
    const Walk walk = PlanWalk(goal);
    const int touches = Touches(walk, kWaitStepS * i, 4.0);
    if (!best.has_value() || touches < best_touches) {
      best = walk;
      best_wait_s = kWaitStepS * i;
      best_touches = touches;
    }
    if (touches == 0) break;
  }
  if (best_wait_s > 0.0) StandFor(best_wait_s);
  Follow(*best, goal);
}

void LifePlanner::StrollAfter(double pause_s) {
  StandFor(pause_s);
  std::optional<Walk> best;
  Goal best_goal;
  int best_touches = 0;
  for (int i = 0; i < kWalkTries; ++i) {
    const Goal goal = DrawNextGoal();
    if ((goal.position - at_.position).norm() < 0.5) continue;
    const Walk walk = PlanWalk(goal);
    const int touches = Touches(walk, 0.0, 8.0);
    if (!best.has_value() || touches < best_touches) {
      best = walk;
      best_goal = goal;
      best_touches = touches;
    }
    if (touches == 0) break;
  }
  if (best.has_value()) Follow(*best, best_goal);
}

void LifePlanner::AddReach(const ReachStand& stand) {
  TurnTo(stand.yaw);
  const double half_hold_s = 0.5 * LifeReach::kHoldS;
  LifeReach reach;
  reach.contact_ns = now_ns_ + NsOf(LifeReach::kInS + half_hold_s);
  reach.plan = stand.reach;
  reach.target_map = stand.target_map;
  out_.life.reaches.push_back(reach);
  StandFor(LifeReach::kInS + LifeReach::kHoldS + LifeReach::kOutS);
}

void LifePlanner::DoErrand() {
  if (hands_full_) return;
  const std::optional<ObjectChoice> choice =
      first_.has_value() ? first_ : stage_.board->TakeObject(body_, hand_, at_.position, &random_);
  first_.reset();
  if (!choice.has_value()) return;
  WalkTo(choice->stand.goal);
  AddReach(choice->stand);
  PickEvent pick;
  pick.object = choice->object;
  pick.person = person_;
  pick.pick_ns = out_.life.reaches.back().contact_ns;
  pick.room = stage_.world->furniture[pick.object].room;
  pick.hand_joint = HandJoint(hand_);
  // An event that the log cannot show in full is none.
  if (pick.pick_ns > NsOf(stage_.duration_s - LifeReach::kOutS)) {
    out_.life.reaches.pop_back();
    stage_.board->GiveBack(choice->object);
    return;
  }
  hands_full_ = true;
  BringAway(pick);
}

void LifePlanner::BringAway(PickEvent pick) {
  LifeCarry carry = {pick.pick_ns, kTimeMax, hand_};
  const double left_s = stage_.duration_s - SecondsOf(now_ns_);
  const double range_m =
      std::clamp(kStraightMps * (left_s - kTurnAndReachS), kCarryNearM, kCarryRangeM);
  std::optional<ReachStand> spot;
  if (!random_.Chance(kKeepProbability)) {
    spot = stage_.board->ReserveSpot(body_, hand_, pick.object, at_.position, range_m, &random_);
  }
  if (spot.has_value()) {
    WalkTo(spot->goal);
    AddReach(*spot);
    const TimeNs place_ns = out_.life.reaches.back().contact_ns;
    if (place_ns <= NsOf(stage_.duration_s - LifeReach::kOutS)) {
      pick.place_ns = place_ns;
      pick.map_T_object_after.position = spot->target_map;
      carry.end_ns = place_ns;
      hands_full_ = false;
    } else {
      out_.life.reaches.pop_back();
    }
  }
  out_.life.carries.push_back(carry);
  out_.picks.push_back(pick);
}

PlannedLife LifePlanner::Plan(const std::vector<double>& errand_times_s) {
  Start(errand_times_s);
  size_t next = 0;
  double pause_s = random_.Uniform(0.5, 6.0);
  while (!IsOver()) {
    const double now_s = SecondsOf(now_ns_);
    const bool has_errand = next < errand_times_s.size() && !hands_full_;
    if (has_errand && now_s + pause_s >= errand_times_s[next]) {
      StandFor(errand_times_s[next] - now_s);
      ++next;
      DoErrand();
      pause_s = random_.Uniform(1.0, 4.0);
      continue;
    }
    StrollAfter(pause_s);
    pause_s = random_.Uniform(2.0, 16.0);
  }
  return std::move(out_);
}

}  // namespace dsg::simulator
