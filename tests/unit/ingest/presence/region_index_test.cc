// SPDX-License-Identifier: Apache-2.0
// Rooms and places of a position, with hysteresis.
#include "ingest/presence/region_index.h"

#include <gtest/gtest.h>

#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

// The rooms that a walk over `points` is in, as printed ids.
std::string RoomsOfWalk(const RegionIndex& index, const std::vector<Eigen::Vector3d>& points) {
  std::string rooms;
  RegionState state;
  for (const Eigen::Vector3d& point : points) {
    state = index.Next(state, point);
    rooms += state.room < 0 ? "-" : ToString(index.RoomId(state.room));
    rooms += " ";
  }
  return rooms;
}

TEST(RegionIndex, KeepsARoomUntilItIsClearlyLeft) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5), MakeRoom(2, 5, 0, 10, 5)}, {}, {});
  EXPECT_EQ(
      RoomsOfWalk(index,
                  {{4, 2, 0}, {5.1, 2, 0}, {5.29, 2, 0}, {5.31, 2, 0}, {4.8, 2, 0}, {4.69, 2, 0}}),
      "R1 R1 R1 R2 R2 R1 ");
}

TEST(RegionIndex, TakesItsDistancesFromTheOptions) {
  const std::vector<Node> rooms = {MakeRoom(1, 0, 0, 5, 5), MakeRoom(2, 5, 0, 10, 5)};
  RegionOptions options;
  options.hysteresis_m = 0.0;
  EXPECT_EQ(RoomsOfWalk(RegionIndex(rooms, {}, {}, options), {{4, 2, 0}, {5.1, 2, 0}, {4.9, 2, 0}}),
            "R1 R2 R1 ");
  options.hysteresis_m = 1.5;
  EXPECT_EQ(RoomsOfWalk(RegionIndex(rooms, {}, {}, options), {{4, 2, 0}, {6.4, 2, 0}, {6.6, 2, 0}}),
            "R1 R1 R2 ");
  // The near place is behind a wall, the far one in sight: but not from so far away.
  const std::vector<Node> places = {MakePlace(1, 1, 0), MakePlace(2, -4, 0)};
  for (const double sight_m : {5.0, 3.0}) {
    options.sight_m = sight_m;
    RegionIndex index({}, places, {}, options);
    index.SetSight(
        [](const Eigen::Vector3d&, const Eigen::Vector3d& place) { return place.x() < 0; });
    EXPECT_EQ(index.PlaceId(index.Next({}, {0, 0, 0}).place), NodeId('p', sight_m == 5.0 ? 2 : 1));
  }
}

TEST(RegionIndex, EntersFromNowhereAtOnceAndLeavesToNowhereClearly) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5)}, {}, {});
  EXPECT_EQ(
      RoomsOfWalk(index, {{-1, 2, 0}, {-0.1, 2, 0}, {0.01, 2, 0}, {-0.29, 2, 0}, {-0.31, 2, 0}}),
      "- - R1 R1 - ");
}

TEST(RegionIndex, DoesNotFlipBetweenRoomsThatOverlap) {
  const RegionIndex index({MakeRoom(1, 0, 0, 6, 5), MakeRoom(2, 4, 0, 10, 5)}, {}, {});
  EXPECT_EQ(
      RoomsOfWalk(index, {{3, 2.5, 0}, {4.9, 2.5, 0}, {5.1, 2.5, 0}, {4.9, 2.5, 0}, {5.1, 2.5, 0}}),
      "R1 R1 R1 R1 R1 ");
  EXPECT_EQ(
      RoomsOfWalk(index, {{3, 2.5, 0}, {5.4, 2.5, 0}, {5.1, 2.5, 0}, {4.9, 2.5, 0}, {4.6, 2.5, 0}}),
      "R1 R2 R2 R2 R1 ");
}

TEST(RegionIndex, TellsStoreysApart) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5, 0, 3), MakeRoom(2, 0, 0, 5, 5, 3, 6)}, {}, {});
  EXPECT_EQ(RoomsOfWalk(index, {{2, 2, 3.0}}), "R2 ");
  EXPECT_EQ(RoomsOfWalk(index, {{2, 2, 2.99}}), "R1 ");
  EXPECT_EQ(RoomsOfWalk(index, {{2, 2, 0}, {2, 2, 1.5}, {2, 2, 3.31}, {2, 2, 3}}), "R1 R1 R2 R2 ");
}

TEST(RegionIndex, HoldsFeetMeasuredJustBelowTheFloor) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5)}, {}, {});
  EXPECT_EQ(RoomsOfWalk(index, {{2, 2, -0.02}}), "R1 ");
  EXPECT_EQ(RoomsOfWalk(index, {{2, 2, -0.5}}), "- ");
}

TEST(RegionIndex, CountsTheLowEdgesAsInside) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5)}, {}, {});
  EXPECT_EQ(RoomsOfWalk(index, {{0, 2, 0}}), "R1 ");
  EXPECT_EQ(RoomsOfWalk(index, {{5, 2, 0}}), "- ");
}

TEST(RegionIndex, TakesTheBoxOfARoomWithoutOutline) {
  Node box_room = MakeRoom(1, 0, 0, 5, 5);
  box_room.region.reset();
  Node empty_room = MakeRoom(2, 0, 0, 5, 5);
  empty_room.region.reset();
  empty_room.box_node = Box3d();
  const RegionIndex index({empty_room, box_room}, {}, {});
  EXPECT_EQ(RoomsOfWalk(index, {{2, 2, 1}}), "R1 ");
}

TEST(RegionIndex, FollowsAnOutlineThatIsNoBox) {
  Node room = MakeRoom(1, 0, 0, 4, 4);
  room.region->footprint_map = {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 4}, {0, 4}};
  const RegionIndex index({room}, {}, {});
  EXPECT_EQ(RoomsOfWalk(index, {{3, 3, 1}, {3, 0.5, 1}, {0.5, 3, 1}, {1.2, 2, 1}, {1.4, 2, 1}}),
            "- R1 R1 R1 - ");
}

TEST(RegionIndex, ChoosesTheNearestPlaceOfTheRoom) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5), MakeRoom(2, 5, 0, 10, 5)},
                          {MakePlace(1, 1, 2), MakePlace(2, 5.1, 2), MakePlace(3, 4, 2)},
                          {{NodeId('R', 1), NodeId('p', 1)},
                           {NodeId('R', 2), NodeId('p', 2)},
                           {NodeId('R', 1), NodeId('p', 3)}});
  RegionState state = index.Next({}, {4.9, 2, 0});
  EXPECT_EQ(index.PlaceId(state.place), NodeId('p', 3));
  state = index.Next(state, {2.4, 2, 0});
  EXPECT_EQ(index.PlaceId(state.place), NodeId('p', 3)) << "0.2 m nearer is not clear";
  state = index.Next(state, {2.3, 2, 0});
  EXPECT_EQ(index.PlaceId(state.place), NodeId('p', 1));
  state = index.Next(state, {6, 2, 0});
  EXPECT_EQ(index.PlaceId(state.place), NodeId('p', 2));
}

TEST(RegionIndex, ChoosesAmongAllPlacesWhereTheRoomHasNone) {
  const RegionIndex index({MakeRoom(1, 0, 0, 5, 5)}, {MakePlace(1, 9, 9), MakePlace(2, 6, 6)}, {});
  const RegionState inside = index.Next({}, {2, 2, 0});
  EXPECT_EQ(index.PlaceId(inside.place), NodeId('p', 2));
  const RegionState outside = index.Next({}, {20, 20, 0});
  EXPECT_EQ(outside.room, -1);
  EXPECT_EQ(index.PlaceId(outside.place), NodeId('p', 1));
}

// A wall along x = 0 with places on both sides.
RegionIndex MakeWalledIndex() {
  RegionIndex index({}, {MakePlace(1, -2.0, 0), MakePlace(2, 1.0, 0)}, {});
  index.SetSight([](const Eigen::Vector3d& point_map, const Eigen::Vector3d& place_map) {
    return point_map.x() * place_map.x() >= 0.0;
  });
  return index;
}

TEST(RegionIndex, TakesThePlaceInSightBeforeANearerOneBehindAWall) {
  const RegionIndex index = MakeWalledIndex();
  EXPECT_EQ(index.PlaceId(index.Next({}, {-0.2, 0, 1}).place), NodeId('p', 1));
  EXPECT_EQ(index.PlaceId(index.Next({}, {0.2, 0, 1}).place), NodeId('p', 2));
}

TEST(RegionIndex, LeavesAPlaceThatIsOutOfSight) {
  const RegionIndex index = MakeWalledIndex();
  const RegionState before = index.Next({}, {0.2, 0, 1});
  EXPECT_EQ(index.PlaceId(index.Next(before, {-0.1, 0, 1}).place), NodeId('p', 1));
}

TEST(RegionIndex, TakesTheNearestWhereNothingIsInSight) {
  RegionIndex index({}, {MakePlace(1, -2.0, 0), MakePlace(2, 1.0, 0)}, {});
  index.SetSight([](const Eigen::Vector3d&, const Eigen::Vector3d&) { return false; });
  const RegionState state = index.Next({}, {-0.2, 0, 1});
  EXPECT_EQ(index.PlaceId(state.place), NodeId('p', 2));
  EXPECT_EQ(index.Next(state, {-0.3, 0, 1}), state) << "blindness is no reason to change";
}

}  // namespace
}  // namespace dsg::ingest
