// SPDX-License-Identifier: Apache-2.0
// Room visits tile the time and agree with a naive scan of the walk.
#include "ingest/simulator/presence.h"

#include <gtest/gtest.h>

namespace dsg::simulator {
namespace {

TEST(RoomVisits, TileTheTimeAndAgreeWithANaiveScan) {
  const uint64_t seed = 31;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  const World world = *GenerateWorld({WorldKind::kOffice, seed});
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
      EXPECT_TRUE(visits[i].room == 0 || visits[i - 1].room == 0);
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

TEST(RoomVisits, CrossTheDoorAtTheInstantTheySay) {
  const World world = *GenerateWorld({WorldKind::kApartment, 32});
  const Planner planner(&world);
  const AgentSpec agent = MakeCrowd(1).front();
  Walker first(&world, &planner, agent, 32);
  const auto visits = RoomVisits(world.plan, 600 * kNsPerSecond, &first);
  Walker second(&world, &planner, agent, 32);
  for (size_t i = 1; i < visits.size(); ++i) {
    const Point at = second.PoseAt(visits[i].enter_ns).position;
    double nearest = 1e9;
    for (const Door& door : world.plan.doors) {
      if (std::abs(at.x() - door.center.x()) > 0.5 * door.width_m) continue;
      nearest = std::min(nearest, std::abs(at.y() - door.center.y()));
    }
    EXPECT_LT(nearest, 1e-6) << "visit " << i;
  }
}

}  // namespace
}  // namespace dsg::simulator
