// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/robot_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "ingest/simulator/motion/schedule.h"
#include "ingest/simulator/motion/spline.h"
#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

constexpr double kKnotS = 0.1;
// The spline smooths over six knots; whoever stands must stand for three more.
constexpr double kSmoothedS = 3.0 * kKnotS;
// A log without standstill begins this far into the walk.
constexpr double kWalkedS = 1.2;
// Below this one may look around from the door rather than miss a room.
constexpr double kShortS = 90.0;
constexpr int kRushAttempts = 5;
constexpr double kBobM = 0.02;
constexpr double kBobHz = 1.8;
// In which the bob grows after a standstill.
constexpr double kBobGrowthS = 1.0;

// From the pleasant pace to the hasty one.
constexpr Pace kStroll;
constexpr Pace kHurry = {.speed_ratio_min = 0.95,
                         .speed_ratio_max = 1.0,
                         .acceleration_m_s2 = 0.9,
                         .turn_rad_s = 1.0,
                         .look_rad_s = 1.25,
                         .look_before_s = 1.0,
                         .look_after_s = 2.6,
                         .center_pull = 2.0};
constexpr Pace kRush = [] {
  Pace pace = kHurry;
  pace.center_pull = 0.3;
  return pace;
}();

struct Derivatives {
  double value = 0.0;
  double rate = 0.0;
  double rate_of_rate = 0.0;
};

// 0 before u = 0, 1 after u = 1, C4 in between.
Derivatives SmoothStep(double u) {
  if (u <= 0.0) return {0.0, 0.0, 0.0};
  if (u >= 1.0) return {1.0, 0.0, 0.0};
  const double v = 1.0 - u;
  const double u2 = u * u;
  // The integral of 630 u^4 (1 - u)^4.
  const double value = u2 * u2 * u * (126.0 + u * (-420.0 + u * (540.0 + u * (-315.0 + 70.0 * u))));
  const double bell = 630.0 * u2 * u * v * v * v;
  return {value, bell * u * v, 4.0 * bell * (1.0 - 2.0 * u)};
}

// Up and down with the steps of whoever carries the rig.
Derivatives BobAt(double time_s, double still_s) {
  const double rate = 2.0 * std::numbers::pi * kBobHz;
  const double s = kBobM * std::sin(rate * time_s);
  const double c = kBobM * std::cos(rate * time_s);
  if (still_s <= 0.0) return {s, rate * c, -rate * rate * s};
  const Derivatives grown = SmoothStep((time_s - still_s) / kBobGrowthS);
  const double growth = grown.rate / kBobGrowthS;
  return {grown.value * s, growth * s + grown.value * rate * c,
          grown.rate_of_rate / (kBobGrowthS * kBobGrowthS) * s + 2.0 * growth * rate * c -
              grown.value * rate * rate * s};
}

class SplineMotion : public RobotMotion {
 public:
  SplineMotion(const World& world, const RobotMotionOptions& options, const Pace& pace,
               uint64_t seed, int attempt)
      : options_(options),
        duration_ns_(std::llround(options.duration_s * 1e9)),
        spline_(MakeSpline(world, options, pace, seed, attempt)) {
    CountRooms(world);
  }

  TimeNs duration_ns() const override { return duration_ns_; }
  int rooms_visited() const override { return rooms_visited_; }

  MotionState StateAt(TimeNs time_ns) const override {
    DSG_CHECK(time_ns >= 0 && time_ns <= duration_ns_);
    const double time_s = 1e-9 * static_cast<double>(time_ns);
    const QuinticSpline::Sample sample = spline_.At(time_s);
    const Derivatives bob = options_.hand_held ? BobAt(time_s, options_.still_s) : Derivatives();
    MotionState state;
    state.map_T_body.position << sample.value[0], sample.value[1], options_.height_m + bob.value;
    state.velocity_map << sample.rate[0], sample.rate[1], bob.rate;
    state.acceleration_map << sample.rate_of_rate[0], sample.rate_of_rate[1], bob.rate_of_rate;
    // R = Rz(yaw) Ry(-elevation): no roll, and raising the look turns about minus y.
    const double yaw = sample.value[2];
    const double pitch = -sample.value[3];
    state.map_T_body.orientation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY());
    const double yaw_rate = sample.rate[2];
    state.angular_velocity_body << -std::sin(pitch) * yaw_rate, -sample.rate[3],
        std::cos(pitch) * yaw_rate;
    return state;
  }

 private:
  static QuinticSpline MakeSpline(const World& world, const RobotMotionOptions& options,
                                  const Pace& pace, uint64_t seed, int attempt) {
    const double begin_s = options.still_s > 0.0 ? options.still_s + kSmoothedS : -kWalkedS;
    const double end_s = options.duration_s + 4.0 * kKnotS - begin_s;
    const Schedule schedule(world, pace, options, end_s, seed, attempt);
    return QuinticSpline(options.duration_s, kKnotS,
                         [&](double time_s) { return schedule.At(time_s - begin_s); });
  }

  void CountRooms(const World& world) {
    std::set<int> rooms;
    for (TimeNs time_ns = 0; time_ns <= duration_ns_; time_ns += kNsPerSecond / 10) {
      rooms.insert(world.plan.RoomAt(StateAt(time_ns).map_T_body.position.head<2>()));
    }
    rooms.erase(-1);
    rooms_visited_ = static_cast<int>(rooms.size());
  }

  const RobotMotionOptions options_;
  const TimeNs duration_ns_;
  const QuinticSpline spline_;
  int rooms_visited_ = 0;
};

}  // namespace

std::unique_ptr<RobotMotion> RobotMotion::Make(const World& world,
                                               const RobotMotionOptions& options, uint64_t seed) {
  const int room_count = static_cast<int>(world.plan.rooms.size());
  std::unique_ptr<RobotMotion> best =
      std::make_unique<SplineMotion>(world, options, kStroll, seed, 0);
  const auto try_pace = [&](const Pace& pace, int attempt) {
    if (best->rooms_visited() == room_count) return;
    auto faster = std::make_unique<SplineMotion>(world, options, pace, seed, attempt);
    if (faster->rooms_visited() > best->rooms_visited()) best = std::move(faster);
  };
  try_pace(kHurry, 0);
  if (options.duration_s >= kShortS) return best;
  // Each attempt starts elsewhere.
  for (int attempt = 0; attempt < kRushAttempts; ++attempt) try_pace(kRush, attempt);
  return best;
}

}  // namespace dsg::simulator
