// SPDX-License-Identifier: Apache-2.0
// Room visits tile the time and agree with a naive scan of the walk.
#include "ingest/simulator/tracks/presence.h"

#include <gtest/gtest.h>

#include <string>

namespace dsg::simulator {
namespace {

/// The door between two rooms; null without one.
const Door* DoorBetween(const FloorPlan& plan, int from, int to) {
  for (const Door& door : plan.doors) {
    if (door.Joins(from) && door.Other(from) == to) return &door;
  }
  return nullptr;
}

class RoomVisitsIn : public testing::TestWithParam<WorldKind> {};

TEST_P(RoomVisitsIn, TileTheTimeAndAgreeWithANaiveScan) {
  const uint64_t seed = 31;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  const World world = *GenerateWorld({GetParam(), seed});
  const Planner planner(&world);
  constexpr TimeNs kUntil = 1200 * kNsPerSecond;
  for (const AgentSpec& agent : MakeCrowd(4)) {
    Walker first(&world, &planner, agent, seed);
    const std::vector<RoomVisit> visits = RoomVisits(world.plan, kUntil, &first);
    ASSERT_GT(visits.size(), 5u);
    EXPECT_EQ(visits.front().enter_ns, 0);
    EXPECT_EQ(visits.back().exit_ns, kUntil);
    for (size_t i = 0; i < visits.size(); ++i) {
      EXPECT_LT(visits[i].enter_ns, visits[i].exit_ns);
      if (i == 0) continue;
      EXPECT_EQ(visits[i].enter_ns, visits[i - 1].exit_ns);
      EXPECT_NE(visits[i].room, visits[i - 1].room);
      // One changes rooms through a door only.
      EXPECT_NE(DoorBetween(world.plan, visits[i - 1].room, visits[i].room), nullptr);
    }
    Walker second(&world, &planner, agent, seed);
    size_t visit = 0;
    for (TimeNs t = 0; t < kUntil; t += 37'000'000) {
      while (t >= visits[visit].exit_ns) ++visit;
      EXPECT_EQ(world.plan.RoomAt(second.PoseAt(t).position), visits[visit].room)
          << agent.name << " at " << t;
    }
  }
}

TEST_P(RoomVisitsIn, CrossTheDoorAtTheInstantTheySay) {
  const World world = *GenerateWorld({GetParam(), 32});
  const Planner planner(&world);
  const AgentSpec agent = MakeCrowd(1).front();
  Walker first(&world, &planner, agent, 32);
  const auto visits = RoomVisits(world.plan, 600 * kNsPerSecond, &first);
  Walker second(&world, &planner, agent, 32);
  for (size_t i = 1; i < visits.size(); ++i) {
    const Point at = second.PoseAt(visits[i].enter_ns).position;
    const Door* door = DoorBetween(world.plan, visits[i - 1].room, visits[i].room);
    ASSERT_NE(door, nullptr) << "visit " << i;
    const Point off = (at - door->center).cwiseAbs();
    EXPECT_LT(door->walks_along_y ? off.y() : off.x(), 1e-6) << "visit " << i;
    EXPECT_LT(door->walks_along_y ? off.x() : off.y(), 0.5 * door->width_m) << "visit " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, RoomVisitsIn,
                         testing::Values(WorldKind::kOffice, WorldKind::kWing,
                                         WorldKind::kApartment),
                         [](const auto& param) { return std::string(Name(param.param)); });

}  // namespace
}  // namespace dsg::simulator
