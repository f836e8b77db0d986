// SPDX-License-Identifier: Apache-2.0
// Rooms of hand-made place graphs, told apart by the clearance of their ways.
#include "ingest/rooms/filtration.h"

#include <gtest/gtest.h>

#include <set>

namespace dsg::ingest {
namespace {

// `count` places in a row, `clearance_m` apart in width.
void AddRow(int first, int count, double clearance_m, std::vector<RoomLink>* links) {
  for (int i = 1; i < count; ++i) links->push_back({first + i - 1, first + i, clearance_m});
}

TEST(Filtration, CutsAtTheNarrowDoor) {
  std::vector<RoomLink> links;
  AddRow(0, 12, 1.4, &links);
  AddRow(12, 12, 1.5, &links);
  links.push_back({11, 12, 0.45});
  const std::vector<int> rooms = FiltrationRooms(24, links, {});
  for (int place = 0; place < 24; ++place) EXPECT_EQ(rooms[place], place < 12 ? 0 : 1);
}

TEST(Filtration, LeavesOneRoomWhole) {
  std::vector<RoomLink> links;
  AddRow(0, 20, 1.0, &links);
  const std::vector<int> rooms = FiltrationRooms(20, links, {});
  EXPECT_EQ(rooms, std::vector<int>(20, 0));
}

TEST(Filtration, GivesDoorwaysToTheSideOfTheWiderWay) {
  std::vector<RoomLink> links;
  AddRow(0, 12, 1.4, &links);
  AddRow(12, 12, 1.5, &links);
  // A place in the doorway.
  links.push_back({11, 24, 0.40});
  links.push_back({24, 12, 0.45});
  EXPECT_EQ(FiltrationRooms(25, links, {})[24], 1);
}

TEST(Filtration, TakesTheCountThatHoldsLongest) {
  // Three rooms; two of them part at 1.1 m already, all three only below 0.6 m.
  std::vector<RoomLink> links;
  AddRow(0, 12, 1.4, &links);
  AddRow(12, 12, 1.4, &links);
  AddRow(24, 12, 1.4, &links);
  links.push_back({11, 12, 1.1});
  links.push_back({23, 24, 0.6});
  const std::vector<int> rooms = FiltrationRooms(36, links, {});
  EXPECT_EQ(std::set<int>(rooms.begin(), rooms.end()).size(), 2u);
  EXPECT_EQ(rooms[0], rooms[12]);
  EXPECT_NE(rooms[0], rooms[24]);
}

TEST(Filtration, LeavesPlacesWithoutAWayAlone) {
  std::vector<RoomLink> links;
  AddRow(0, 12, 1.4, &links);
  EXPECT_EQ(FiltrationRooms(13, links, {})[12], -1);
  EXPECT_TRUE(FiltrationRooms(0, {}, {}).empty());
  // Links to nowhere, and smaller graphs than a room.
  EXPECT_EQ(FiltrationRooms(2, {{0, 7, 1.0}, {-1, 0, 1.0}, {1, 1, 1.0}}, {}),
            (std::vector<int>{-1, -1}));
}

}  // namespace
}  // namespace dsg::ingest
