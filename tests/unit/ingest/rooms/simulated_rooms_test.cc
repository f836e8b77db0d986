// SPDX-License-Identifier: Apache-2.0
// Rooms of the simulator's buildings, against what was drawn.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "tests/unit/ingest/rooms/rooms_test_util.h"

namespace dsg::ingest {
namespace {

using simulator::WorldKind;

struct Case {
  WorldKind kind;
  uint64_t seed;
};

std::string NameOf(const Case& which) {
  return std::string(simulator::Name(which.kind)) + std::to_string(which.seed);
}

void UseWorldPlaces(const simulator::World& world, RoomInput* input) {
  for (const simulator::Place& place : world.places.places) {
    input->places.push_back({{place.position.x(), place.position.y(), 0.0}, place.clearance_m});
  }
  for (const simulator::PlaceEdge& edge : world.places.edges) {
    input->links.push_back({edge.from, edge.to, edge.clearance_m});
  }
}

struct Found {
  RoomResult rooms;
  evaluation::RoomResult score;
};

Found FindIn(const simulator::World& world, const OccupancyGrid& whole, const OccupancyGrid& seen,
             const RoomOptions& options, const std::string& name) {
  const DistanceField field(seen);
  RoomInput input = InputOf(field, world.plan.ceiling_m);
  UseWorldPlaces(world, &input);
  Found found;
  const auto start = std::chrono::steady_clock::now();
  found.rooms = FindRooms(input, options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  found.score = Score(world, whole, input, found.rooms.best);
  std::printf("%-28s %.2f s %s%s\n", name.c_str(), took.count(), ToText(found.score).c_str(),
              found.rooms.alternative.has_value() ? " (alternative)" : "");
  MaybeDraw(name, field, input, found.rooms.best);
  return found;
}

class SimulatedRoomsTest : public testing::TestWithParam<Case> {
 protected:
  SimulatedRoomsTest()
      : world_(MakeWorld(GetParam().kind, GetParam().seed)), grid_(GridOfWorld(world_)) {}

  Found Find(const OccupancyGrid& seen, RoomMethod method, const std::string& name) const {
    RoomOptions options;
    options.method = method;
    return FindIn(world_, grid_, seen, options, NameOf(GetParam()) + "-" + name);
  }

  // Offices have nets of corridors. The truth lets some corridors run through a crossing and ends
  // the others there; which ones cannot be seen, so that each arm is a room to us.
  void ExpectGood(const Found& found) const {
    const bool is_office = GetParam().kind == WorldKind::kOffice;
    EXPECT_GE(found.score.outside_doors.precision.value_or(0.0), is_office ? 0.95 : 0.99);
    EXPECT_GE(found.score.outside_doors.recall.value_or(0.0), is_office ? 0.95 : 0.99);
    EXPECT_GE(found.score.volumetric.precision.value_or(0.0), 0.93);
    if (is_office) return;
    EXPECT_EQ(found.score.count, found.score.count_truth);
    EXPECT_GE(found.score.adjacency_f1.value_or(0.0), 0.99);
  }

  const simulator::World world_;
  const OccupancyGrid grid_;
};

TEST_P(SimulatedRoomsTest, AreFoundByTheCeilingAndByBothMethodsTogether) {
  ExpectGood(Find(grid_, RoomMethod::kCeiling, "ceiling"));
  ExpectGood(Find(grid_, RoomMethod::kAuto, "auto"));
}

using HalfSeenRoomsTest = SimulatedRoomsTest;

TEST_P(HalfSeenRoomsTest, AreFoundWhereAThirdOfTheCeilingWasNotSeen) {
  OccupancyGrid seen = grid_;
  HidePatches(0.3, GetParam().seed, &seen);
  const Found found = Find(seen, RoomMethod::kAuto, "patches");
  EXPECT_GE(found.score.outside_doors.precision.value_or(0.0), 0.95);
  EXPECT_GE(found.score.outside_doors.recall.value_or(0.0), 0.95);
}

TEST_P(HalfSeenRoomsTest, AreFoundWithoutACeiling) {
  OccupancyGrid seen = grid_;
  HideAbove(2.0, &seen);
  const Found found = Find(seen, RoomMethod::kAuto, "no-ceiling");
  EXPECT_GE(found.score.outside_doors.precision.value_or(0.0), 0.95);
  EXPECT_GE(found.score.outside_doors.recall.value_or(0.0), 0.95);
}

INSTANTIATE_TEST_SUITE_P(
    Worlds, SimulatedRoomsTest,
    testing::Values(Case{WorldKind::kApartment, 1}, Case{WorldKind::kApartment, 2},
                    Case{WorldKind::kApartment, 3}, Case{WorldKind::kApartment, 4},
                    Case{WorldKind::kApartment, 5}, Case{WorldKind::kWing, 1},
                    Case{WorldKind::kWing, 2}, Case{WorldKind::kWing, 3}, Case{WorldKind::kWing, 4},
                    Case{WorldKind::kWing, 5}, Case{WorldKind::kOffice, 1},
                    Case{WorldKind::kOffice, 2}, Case{WorldKind::kOffice, 3},
                    Case{WorldKind::kOffice, 4}, Case{WorldKind::kOffice, 5}),
    [](const auto& which) { return NameOf(which.param); });
INSTANTIATE_TEST_SUITE_P(Worlds, HalfSeenRoomsTest,
                         testing::Values(Case{WorldKind::kApartment, 2}, Case{WorldKind::kWing, 2},
                                         Case{WorldKind::kOffice, 1}),
                         [](const auto& which) { return NameOf(which.param); });

}  // namespace
}  // namespace dsg::ingest
