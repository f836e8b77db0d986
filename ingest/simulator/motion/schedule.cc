// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "ingest/simulator/motion/floor_line.h"
#include "ingest/simulator/motion/tour.h"
#include "ingest/simulator/world/planner.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kTourStream = 0x746f7572;  // "tour"
constexpr double kSightM = 0.8;
constexpr double kLookAcceleration = 1.5;
// High enough to see the ceiling, low enough to see the floor.
constexpr double kLookElevation = 15.0 * std::numbers::pi / 180.0;

}  // namespace

void Schedule::Join(const Pace& pace, Leg* leg, Leg* next) {
  const double arrival_s = leg->begin_s + leg->walk.duration_s();
  // Two look-arounds do not overlap, however short the walk between them.
  leg->look_begin_s = std::max(leg->look_begin_s, arrival_s - pace.look_before_s);
  leg->look_from = leg->YawAt(leg->look_begin_s);
  // It ends where the next walk will be looking by then.
  const double first = next->walk.HeadingAt(pace.look_after_s);
  const double change = std::remainder(first - leg->look_from, 2.0 * std::numbers::pi);
  leg->look_angle = change + std::copysign(2.0 * std::numbers::pi, change);
  leg->look = SpeedProfile(std::abs(leg->look_angle), pace.look_rad_s, kLookAcceleration);
  next->begin_s = leg->LookEnd() - pace.look_after_s;
  next->yaw_offset = leg->look_from + leg->look_angle - first;
  next->look_begin_s = leg->LookEnd();
}

Schedule::Schedule(const World& world, const Pace& pace, const RobotMotionOptions& options,
                   double duration_s, uint64_t seed, int attempt) {
  Random random(seed, kTourStream + static_cast<uint64_t>(attempt));
  const Tour tour(world, {pace.center_pull, options.first_room}, &random);
  const Planner planner(&world);
  const NearbyObstacles obstacles(world.free_space, kSightM);
  const auto goal = [&](size_t stop) {
    const int place = tour.StopAt(stop);
    return Goal{place, world.places.places[place].position};
  };
  for (size_t stop = 0; legs_.empty() || legs_.back().begin_s <= duration_s; ++stop) {
    const Path path = planner.Plan(goal(stop), goal(stop + 1), &random);
    const WalkLimits limits{
        options.speed_m_s_max * random.Uniform(pace.speed_ratio_min, pace.speed_ratio_max),
        pace.acceleration_m_s2, pace.turn_rad_s};
    Leg leg{.walk = TimedWalk(BendLine(path, obstacles), limits)};
    if (!legs_.empty()) Join(pace, &legs_.back(), &leg);
    legs_.push_back(std::move(leg));
  }
}

Schedule::Reference Schedule::At(double time_s) const {
  const auto after = std::upper_bound(legs_.begin(), legs_.end(), time_s,
                                      [](double t, const Leg& leg) { return t < leg.begin_s; });
  const size_t walking =
      after == legs_.begin() ? 0 : static_cast<size_t>(after - legs_.begin()) - 1;
  const Leg& walk = legs_[walking];
  const Point at = walk.walk.PositionAt(time_s - walk.begin_s);
  // The look-around of the walk before may reach into this one.
  const Leg& leg = walking > 0 && time_s < legs_[walking - 1].LookEnd() ? legs_[walking - 1] : walk;
  if (leg.look_angle == 0.0 || time_s <= leg.look_begin_s) {
    return {at.x(), at.y(), leg.YawAt(time_s), 0.0};
  }
  const double turned = leg.look.DistanceAt(time_s - leg.look_begin_s);
  const double done = turned / std::abs(leg.look_angle);
  return {at.x(), at.y(), leg.look_from + done * leg.look_angle,
          kLookElevation * std::sin(4.0 * std::numbers::pi * done)};
}

}  // namespace dsg::simulator
