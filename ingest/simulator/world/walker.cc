// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/walker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/world/tour.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kWalkerStream = uint64_t{1} << 32;
constexpr double kAccelerationMps2 = 0.7;
constexpr double kTurnRateRadS = 1.5;
constexpr double kRobotBodyHeightM = 0.2;
constexpr double kPi = std::numbers::pi;

constexpr std::array<const char*, 26> kFirstNames = {
    "alice", "bob",   "carol", "david",  "emma",  "frank",  "grace", "henry", "iris",
    "jack",  "karin", "leo",   "maria",  "nora",  "oscar",  "paula", "quinn", "rosa",
    "sam",   "tina",  "uma",   "victor", "wendy", "xavier", "yara",  "zoe"};

double WrapAngle(double angle) { return std::remainder(angle, 2.0 * kPi); }

// Starts and stops without a jerk.
double SmoothStep(double t) { return t * t * (3.0 - 2.0 * t); }

double TurnSeconds(double from, double to) {
  // 1.5 is the peak slope of the smooth step.
  return 1.5 * std::abs(WrapAngle(to - from)) / kTurnRateRadS;
}

TimeNs ToNs(double seconds) {
  return static_cast<TimeNs>(std::llround(seconds * static_cast<double>(kNsPerSecond)));
}

double ToSeconds(TimeNs ns) { return static_cast<double>(ns) / static_cast<double>(kNsPerSecond); }

}  // namespace

std::vector<AgentSpec> MakeCrowd(int people_count) {
  std::vector<AgentSpec> crowd = {{"robot", true, 0}};
  for (int i = 0; i < people_count; ++i) {
    const auto index = static_cast<size_t>(i);
    crowd.push_back(
        {index < kFirstNames.size() ? kFirstNames[index] : absl::StrCat("person-", i + 1), false,
         i + 1});
  }
  std::sort(crowd.begin(), crowd.end(),
            [](const AgentSpec& a, const AgentSpec& b) { return a.name < b.name; });
  return crowd;
}

FloorPose Leg::PoseAt(TimeNs time_ns) const {
  if (time_ns >= depart_ns) {
    const double distance = profile.DistanceAt(ToSeconds(time_ns - depart_ns));
    return {path.At(distance), path.HeadingAt(distance)};
  }
  const double turn_s = TurnSeconds(yaw_begin, yaw_depart);
  const double left_s = ToSeconds(depart_ns - time_ns);
  if (left_s >= turn_s) return {path.points().front(), yaw_begin};
  const double turned = SmoothStep(1.0 - left_s / turn_s);
  return {path.points().front(), WrapAngle(yaw_begin + turned * WrapAngle(yaw_depart - yaw_begin))};
}

Walker::Walker(const World* world, const Planner* planner, const AgentSpec& agent, uint64_t seed)
    : world_(*world),
      planner_(*planner),
      is_robot_(agent.is_robot),
      random_(seed, kWalkerStream + static_cast<uint64_t>(agent.index)),
      room_places_(world->plan.rooms.size()) {
  for (size_t i = 0; i < world_.places.places.size(); ++i) {
    const Place& place = world_.places.places[i];
    if (place.door < 0) room_places_[place.room].push_back(static_cast<int>(i));
  }
  tour_ = is_robot_ ? RoomTour(*world) : RoomsToStay(*world);
  tour_next_ = static_cast<size_t>(random_.Index(static_cast<int>(tour_.size())));
  home_room_ = tour_[tour_next_];
  cruise_m_s_ = is_robot_ ? 0.9 : random_.Uniform(0.95, 1.35);
  const Goal start = planner_.DrawGoal(DrawPlaceIn(home_room_), &random_);
  PlanLeg(0, start, random_.Uniform(-kPi, kPi));
}

int Walker::DrawPlaceIn(int room) {
  const std::vector<int>& places = room_places_[room];
  return places[random_.Index(static_cast<int>(places.size()))];
}

int Walker::NextGoalPlace() {
  if (is_robot_) {
    tour_next_ = (tour_next_ + 1) % tour_.size();
    return RoomiestPlace(world_, tour_[tour_next_]);
  }
  if (random_.Chance(0.35)) return DrawPlaceIn(home_room_);
  return DrawPlaceIn(tour_[random_.Index(static_cast<int>(tour_.size()))]);
}

void Walker::PlanLeg(TimeNs begin_ns, const Goal& start, double yaw_begin) {
  leg_.begin_ns = begin_ns;
  leg_.start = start;
  leg_.goal = planner_.DrawGoal(NextGoalPlace(), &random_);
  leg_.path = planner_.Plan(leg_.start, leg_.goal, &random_);
  const double speed =
      is_robot_ ? cruise_m_s_ : std::clamp(cruise_m_s_ + random_.Uniform(-0.15, 0.15), 0.8, 1.5);
  leg_.profile = SpeedProfile(leg_.path.length_m(), speed, kAccelerationMps2);
  leg_.yaw_begin = yaw_begin;
  leg_.yaw_depart = leg_.path.length_m() > 0.0 ? leg_.path.HeadingAt(0.0) : yaw_begin;
  const double pause_s = is_robot_ ? random_.Uniform(2.0, 4.0) : random_.Uniform(3.0, 30.0);
  const double stand_s = std::max(pause_s, TurnSeconds(leg_.yaw_begin, leg_.yaw_depart));
  leg_.depart_ns = begin_ns + ToNs(stand_s);
  leg_.end_ns = leg_.depart_ns + ToNs(leg_.profile.duration_s());
}

void Walker::NextLeg() {
  const Leg& last = leg_;
  const double yaw =
      last.path.length_m() > 0.0 ? last.path.HeadingAt(last.path.length_m()) : last.yaw_begin;
  PlanLeg(last.end_ns, Goal(last.goal), yaw);
}

FloorPose Walker::PoseAt(TimeNs time_ns) {
  while (time_ns >= leg_.end_ns) NextLeg();
  return leg_.PoseAt(time_ns);
}

Pose3d BodyPose(const FloorPose& pose, bool is_robot) {
  Pose3d out;
  out.position =
      Eigen::Vector3d(pose.position.x(), pose.position.y(), is_robot ? kRobotBodyHeightM : 0.0);
  // The cosine is not negative on [-pi, pi], so equal headings have equal signs.
  out.orientation =
      Eigen::Quaterniond(std::cos(0.5 * pose.yaw), 0.0, 0.0, std::sin(0.5 * pose.yaw));
  return out;
}

}  // namespace dsg::simulator
