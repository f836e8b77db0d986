// SPDX-License-Identifier: Apache-2.0
// A tour stops in every room, comes back, and goes the other way round.
#include "ingest/simulator/motion/tour.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/unit/ingest/simulator/motion/motion_test_util.h"

namespace dsg::simulator {
namespace {

constexpr WorldKind kKinds[] = {WorldKind::kApartment, WorldKind::kWing, WorldKind::kOffice};

TEST(Tour, StopsInEveryRoomOnce) {
  for (const WorldKind kind : kKinds) {
    const World world = MakeWorld(kind, 3);
    Random random(3, 0);
    const Tour tour(world, {}, &random);
    std::set<int> rooms;
    std::set<int> stops;
    for (size_t i = 0; i < tour.round_count(); ++i) {
      const Place& place = world.places.places[tour.StopAt(i)];
      rooms.insert(place.room);
      EXPECT_TRUE(stops.insert(tour.StopAt(i)).second);
      EXPECT_LT(place.door, 0);
    }
    EXPECT_EQ(rooms.size(), world.plan.rooms.size());
  }
}

TEST(Tour, StartsWhereOnePassesThrough) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const World world = MakeWorld(WorldKind::kApartment, seed);
    Random random(seed, 0);
    const Tour tour(world, {}, &random);
    EXPECT_TRUE(world.plan.rooms[world.places.places[tour.StopAt(0)].room].is_passage);
  }
}

TEST(Tour, ComesBackAndGoesTheOtherWayRound) {
  const World world = MakeWorld(WorldKind::kApartment, 2);
  Random random(2, 0);
  const Tour tour(world, {}, &random);
  const size_t count = tour.round_count();
  ASSERT_GT(count, 3u);
  EXPECT_EQ(tour.StopAt(count), tour.StopAt(0));
  for (size_t i = 1; i < count; ++i) EXPECT_EQ(tour.StopAt(count + i), tour.StopAt(count - i));
  for (size_t i = 0; i < 2 * count; ++i) EXPECT_EQ(tour.StopAt(2 * count + i), tour.StopAt(i));
  for (size_t i = 0; i < 5 * count; ++i) EXPECT_NE(tour.StopAt(i), tour.StopAt(i + 1));
}

TEST(Tour, ALargeHallHasSeveralStops) {
  const World world = MakeWorld(WorldKind::kOffice, 1);
  Random random(1, 0);
  const Tour tour(world, {}, &random);
  for (int room = 0; room < static_cast<int>(world.plan.rooms.size()); ++room) {
    const Point size = world.plan.rooms[room].Interior().sizes();
    if (world.plan.rooms[room].is_passage || size.minCoeff() <= 9.0) continue;
    int stop_count = 0;
    for (size_t i = 0; i < tour.round_count(); ++i) {
      stop_count += world.places.places[tour.StopAt(i)].room == room ? 1 : 0;
    }
    EXPECT_GE(stop_count, 4) << world.plan.rooms[room].name;
  }
}

}  // namespace
}  // namespace dsg::simulator
