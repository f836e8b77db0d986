// SPDX-License-Identifier: Apache-2.0
// Tours are smooth, keep clear of everything, keep their limits and see the rooms.
#include "ingest/simulator/motion/robot_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "ingest/simulator/motion/nearby_obstacles.h"
#include "tests/unit/ingest/simulator/motion/motion_test_util.h"

namespace dsg::simulator {
namespace {

RobotMotionOptions Options(double duration_s, uint64_t seed) {
  RobotMotionOptions options;
  options.duration_s = duration_s;
  options.still_s = seed % 2 == 0 ? 0.0 : 1.5;
  options.hand_held = seed % 3 == 0;
  return options;
}

double YawOf(const MotionState& state) {
  const Eigen::Vector3d ahead = state.map_T_body.orientation * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

double ElevationOf(const MotionState& state) {
  return std::asin((state.map_T_body.orientation * Eigen::Vector3d::UnitX()).z());
}

void ExpectWithinLimits(const World& world, const RobotMotion& motion) {
  const NearbyObstacles nearby(world.free_space, 1.0);
  double clearance = 1.0;
  double turn = 0.0;
  double acceleration = 0.0;
  double speed = 0.0;
  for (TimeNs time_ns = 0; time_ns <= motion.duration_ns(); time_ns += 20'000'000) {
    const MotionState state = motion.StateAt(time_ns);
    clearance = std::min(clearance, nearby.Clearance(state.map_T_body.position.head<2>()));
    turn = std::max(turn, state.angular_velocity_body.norm());
    acceleration = std::max(acceleration, state.acceleration_map.norm());
    speed = std::max(speed, state.velocity_map.head<2>().norm());
    ASSERT_LE(std::abs(ElevationOf(state)), 15.01 * std::numbers::pi / 180.0);
  }
  EXPECT_GE(clearance, 0.25);
  EXPECT_LT(turn, 1.5);
  EXPECT_LT(acceleration, 3.0);
  EXPECT_LT(speed, 1.01);
}

TEST(RobotMotion, KeepsClearAndWithinItsLimitsInManyWorlds) {
  for (const WorldKind kind : {WorldKind::kApartment, WorldKind::kWing}) {
    for (uint64_t seed = 1; seed <= 20; ++seed) {
      SCOPED_TRACE(testing::Message() << Name(kind) << ", seed " << seed);
      const World world = MakeWorld(kind, seed);
      ExpectWithinLimits(world, *RobotMotion::Make(world, Options(240.0, seed), seed));
      ExpectWithinLimits(world, *RobotMotion::Make(world, Options(25.0, seed), seed));
    }
  }
}

TEST(RobotMotion, KeepsClearAndWithinItsLimitsInOffices) {
  for (uint64_t world_seed = 1; world_seed <= 2; ++world_seed) {
    const World world = MakeWorld(WorldKind::kOffice, world_seed);
    for (uint64_t seed = 1; seed <= 10; ++seed) {
      SCOPED_TRACE(testing::Message() << "world " << world_seed << ", seed " << seed);
      ExpectWithinLimits(world, *RobotMotion::Make(world, Options(300.0, seed), seed));
    }
  }
}

TEST(RobotMotion, SeesThreeRoomsIn25SecondsAndTheApartmentIn60) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const World world = MakeWorld(WorldKind::kApartment, seed);
    EXPECT_GE(RobotMotion::Make(world, Options(25.0, seed), seed)->rooms_visited(), 3);
    EXPECT_EQ(RobotMotion::Make(world, Options(60.0, seed), seed)->rooms_visited(),
              static_cast<int>(world.plan.rooms.size()));
  }
}

TEST(RobotMotion, SeesAllRoomsOfAnOfficeGivenTheTime) {
  const World world = MakeWorld(WorldKind::kOffice, 1);
  const auto motion = RobotMotion::Make(world, Options(2400.0, 1), 1);
  EXPECT_EQ(motion->rooms_visited(), static_cast<int>(world.plan.rooms.size()));
}

TEST(RobotMotion, CountsTheRoomsItEnters) {
  const World world = MakeWorld(WorldKind::kWing, 4);
  const auto motion = RobotMotion::Make(world, Options(90.0, 4), 4);
  std::set<int> rooms;
  for (TimeNs time_ns = 0; time_ns <= motion->duration_ns(); time_ns += 50'000'000) {
    rooms.insert(world.plan.RoomAt(motion->StateAt(time_ns).map_T_body.position.head<2>()));
  }
  EXPECT_EQ(rooms.count(-1), 0u);
  EXPECT_EQ(motion->rooms_visited(), static_cast<int>(rooms.size()));
}

// In every room that it leaves again it looks to all sides, up and down.
TEST(RobotMotion, LooksToAllSidesInEachRoom) {
  const World world = MakeWorld(WorldKind::kApartment, 6);
  const auto motion = RobotMotion::Make(world, Options(240.0, 6), 6);
  std::vector<std::set<int>> sides(world.plan.rooms.size());
  std::vector<double> highest(world.plan.rooms.size(), 0.0);
  std::vector<double> lowest(world.plan.rooms.size(), 0.0);
  for (TimeNs time_ns = 0; time_ns <= motion->duration_ns(); time_ns += 50'000'000) {
    const MotionState state = motion->StateAt(time_ns);
    const int room = world.plan.RoomAt(state.map_T_body.position.head<2>());
    sides[room].insert(static_cast<int>(std::floor(YawOf(state) / std::numbers::pi * 12.0)));
    highest[room] = std::max(highest[room], ElevationOf(state));
    lowest[room] = std::min(lowest[room], ElevationOf(state));
  }
  for (size_t room = 0; room < sides.size(); ++room) {
    EXPECT_EQ(sides[room].size(), 24u) << world.plan.rooms[room].name;
    EXPECT_GT(highest[room], 14.0 * std::numbers::pi / 180.0) << world.plan.rooms[room].name;
    EXPECT_LT(lowest[room], -14.0 * std::numbers::pi / 180.0) << world.plan.rooms[room].name;
  }
}

TEST(RobotMotion, ComesBackToWhereItWasBefore) {
  const World world = MakeWorld(WorldKind::kApartment, 5);
  const auto motion = RobotMotion::Make(world, Options(240.0, 5), 5);
  const Eigen::Vector3d start = motion->StateAt(0).map_T_body.position;
  double farthest = 0.0;
  double back = 1e9;
  for (TimeNs time_ns = 0; time_ns <= motion->duration_ns(); time_ns += 100'000'000) {
    const double distance = (motion->StateAt(time_ns).map_T_body.position - start).norm();
    farthest = std::max(farthest, distance);
    if (farthest > 3.0) back = std::min(back, distance);
  }
  EXPECT_GT(farthest, 3.0);
  EXPECT_LT(back, 0.1);
}

TEST(RobotMotion, DerivativesMatchCentralDifferences) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const auto motion = MakeMotion(WorldKind::kApartment, seed, Options(60.0, seed));
    const TimeNs h_ns = 100'000;
    const double h = 1e-4;
    for (TimeNs time_ns = h_ns; time_ns + h_ns <= motion->duration_ns(); time_ns += 33'700'000) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " at " << time_ns);
      const MotionState before = motion->StateAt(time_ns - h_ns);
      const MotionState at = motion->StateAt(time_ns);
      const MotionState after = motion->StateAt(time_ns + h_ns);
      const Eigen::Vector3d velocity =
          (after.map_T_body.position - before.map_T_body.position) / (2.0 * h);
      const Eigen::Vector3d acceleration = (after.velocity_map - before.velocity_map) / (2.0 * h);
      const Eigen::AngleAxisd turn(before.map_T_body.orientation.conjugate() *
                                   after.map_T_body.orientation);
      const Eigen::Vector3d spin =
          std::remainder(turn.angle(), 2.0 * std::numbers::pi) / (2.0 * h) * turn.axis();
      // Relative to what a walk has: 1 m/s, 1 m/s^2, 1 rad/s.
      EXPECT_LT((velocity - at.velocity_map).norm(), 1e-6);
      EXPECT_LT((acceleration - at.acceleration_map).norm(), 1e-5);
      EXPECT_LT((spin - at.angular_velocity_body).norm(), 1e-6);
    }
  }
}

TEST(RobotMotion, StandsExactlyStillAtTheBeginningIfAsked) {
  for (const bool hand_held : {false, true}) {
    RobotMotionOptions options;
    options.still_s = 1.5;
    options.hand_held = hand_held;
    const auto motion = MakeMotion(WorldKind::kApartment, 2, options);
    const MotionState start = motion->StateAt(0);
    for (TimeNs time_ns = 0; time_ns <= 1'500'000'000; time_ns += 5'000'000) {
      const MotionState state = motion->StateAt(time_ns);
      EXPECT_EQ(state.velocity_map, Eigen::Vector3d::Zero());
      EXPECT_EQ(state.acceleration_map, Eigen::Vector3d::Zero());
      EXPECT_EQ(state.angular_velocity_body, Eigen::Vector3d::Zero());
      EXPECT_EQ(state.map_T_body.position, start.map_T_body.position);
      EXPECT_EQ(state.map_T_body.orientation.coeffs(), start.map_T_body.orientation.coeffs());
    }
    EXPECT_GT(motion->StateAt(2'800'000'000).velocity_map.norm(), 0.05);
  }
}

TEST(RobotMotion, WalksFromTheFirstInstantWithoutAStandstill) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RobotMotionOptions options;
    options.still_s = 0.0;
    const auto motion = MakeMotion(WorldKind::kApartment, seed, options);
    EXPECT_GT(motion->StateAt(0).velocity_map.norm(), 0.2) << "seed " << seed;
  }
}

TEST(RobotMotion, BobsUpAndDownInTheHand) {
  RobotMotionOptions options;
  options.hand_held = true;
  const auto motion = MakeMotion(WorldKind::kApartment, 3, options);
  double lowest = 10.0;
  double highest = 0.0;
  for (TimeNs time_ns = 5 * kNsPerSecond; time_ns < 7 * kNsPerSecond; time_ns += 1'000'000) {
    const double z = motion->StateAt(time_ns).map_T_body.position.z();
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  }
  EXPECT_NEAR(highest, options.height_m + 0.02, 1e-5);
  EXPECT_NEAR(lowest, options.height_m - 0.02, 1e-5);
}

TEST(RobotMotion, LastsExactlyAsLongAsAsked) {
  for (const double duration_s : {0.01, 1.0, 7.123456789, 25.0}) {
    RobotMotionOptions options;
    options.duration_s = duration_s;
    const auto motion = MakeMotion(WorldKind::kApartment, 1, options);
    EXPECT_EQ(motion->duration_ns(), std::llround(duration_s * 1e9));
    EXPECT_TRUE(IsValidPose(motion->StateAt(motion->duration_ns()).map_T_body));
  }
}

TEST(RobotMotion, SameSeedSameMotion) {
  const World world = MakeWorld(WorldKind::kWing, 1);
  const auto a = RobotMotion::Make(world, {}, 8);
  const auto b = RobotMotion::Make(world, {}, 8);
  const auto c = RobotMotion::Make(world, {}, 9);
  for (TimeNs time_ns = 0; time_ns <= a->duration_ns(); time_ns += 50'000'000) {
    EXPECT_EQ(a->StateAt(time_ns).map_T_body.position, b->StateAt(time_ns).map_T_body.position);
    EXPECT_EQ(a->StateAt(time_ns).velocity_map, b->StateAt(time_ns).velocity_map);
  }
  EXPECT_NE(a->StateAt(0).map_T_body.position, c->StateAt(0).map_T_body.position);
}

TEST(RobotMotionDeathTest, RefusesTimesOutsideOfItsDuration) {
  const auto motion = MakeMotion(WorldKind::kApartment, 1, {});
  EXPECT_DEATH(motion->StateAt(-1), "broken invariant");
  EXPECT_DEATH(motion->StateAt(motion->duration_ns() + 1), "broken invariant");
}

}  // namespace
}  // namespace dsg::simulator
