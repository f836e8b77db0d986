// SPDX-License-Identifier: Apache-2.0
// The robot's round trip visits each room once and does not run to and fro.
#include "ingest/simulator/world/tour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "ingest/simulator/world/planner.h"

namespace dsg::simulator {
namespace {

double LengthOf(const World& world, const Planner& planner, const std::vector<int>& rooms) {
  Random random(1, 1);
  double length = 0.0;
  for (size_t i = 0; i < rooms.size(); ++i) {
    const Goal from = planner.DrawGoal(RoomiestPlace(world, rooms[i]), &random);
    const Goal to = planner.DrawGoal(RoomiestPlace(world, rooms[(i + 1) % rooms.size()]), &random);
    length += planner.Plan(from, to, &random).length_m();
  }
  return length;
}

TEST(RoomTour, VisitsEachRoomOnceOnAShortWay) {
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kWing, WorldKind::kApartment}) {
    const World world = *GenerateWorld({kind, 3});
    const Planner planner(&world);
    const std::vector<int> tour = RoomTour(world);
    std::vector<int> sorted = tour;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(sorted, RoomsToStay(world));
    // An office tour is about 15 m a room, in the order of the rooms' indices about 30.
    const double by_index = LengthOf(world, planner, sorted);
    const double by_tour = LengthOf(world, planner, tour);
    EXPECT_LT(by_tour, 1.05 * by_index) << Name(kind);
    if (kind == WorldKind::kOffice) {
      EXPECT_LT(by_tour, 0.75 * by_index);
    }
  }
}

}  // namespace
}  // namespace dsg::simulator
