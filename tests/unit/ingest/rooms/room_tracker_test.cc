// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "ingest/rooms/find_rooms.h"

namespace dsg::ingest {
namespace {

/// Places a metre apart along x; each room is a range of them.
std::vector<RoomPlace> Places(int count, double shift_m = 0.0) {
  std::vector<RoomPlace> places;
  for (int i = 0; i < count; ++i) places.push_back({{i + shift_m, 0.0, 0.0}, 1.0});
  return places;
}

FoundRoom RoomOfPlaces(int begin, int end) {
  FoundRoom room;
  for (int i = begin; i < end; ++i) room.places.push_back(i);
  return room;
}

TEST(RoomTracker, KeepsIdsWhileTheMapGrows) {
  RoomTracker tracker;
  std::vector<FoundRoom> rooms = {RoomOfPlaces(0, 4), RoomOfPlaces(4, 6)};
  tracker.Track(Places(6), &rooms);
  EXPECT_EQ(rooms[0].id, 0);
  EXPECT_EQ(rooms[1].id, 1);
  // More of the second room, a third one, everything a little moved, in another order.
  std::vector<FoundRoom> grown = {RoomOfPlaces(12, 15), RoomOfPlaces(4, 12), RoomOfPlaces(0, 4)};
  tracker.Track(Places(15, 0.2), &grown);
  EXPECT_EQ(grown[0].id, 2);
  EXPECT_EQ(grown[1].id, 1);
  EXPECT_EQ(grown[2].id, 0);
}

TEST(RoomTracker, GivesTheLargerPartOfASplitTheId) {
  RoomTracker tracker;
  std::vector<FoundRoom> rooms = {RoomOfPlaces(0, 10)};
  tracker.Track(Places(10), &rooms);
  std::vector<FoundRoom> parts = {RoomOfPlaces(0, 3), RoomOfPlaces(3, 10)};
  tracker.Track(Places(10), &parts);
  EXPECT_EQ(parts[0].id, 1);
  EXPECT_EQ(parts[1].id, 0);
}

TEST(RoomTracker, GivesMergedRoomsTheIdOfTheLargerOneAndNeverTheOtherAgain) {
  RoomTracker tracker;
  std::vector<FoundRoom> rooms = {RoomOfPlaces(0, 3), RoomOfPlaces(3, 10)};
  tracker.Track(Places(10), &rooms);
  std::vector<FoundRoom> merged = {RoomOfPlaces(0, 10)};
  tracker.Track(Places(10), &merged);
  EXPECT_EQ(merged[0].id, 1);
  std::vector<FoundRoom> apart = {RoomOfPlaces(0, 3), RoomOfPlaces(3, 10)};
  tracker.Track(Places(10), &apart);
  EXPECT_EQ(apart[0].id, 2);
  EXPECT_EQ(apart[1].id, 1);
}

TEST(RoomTracker, TakesRoomsOneAboveTheOtherForTwo) {
  RoomTracker tracker;
  std::vector<RoomPlace> places = {{{0.0, 0.0, 0.0}, 1.0}, {{0.0, 0.0, 3.0}, 1.0}};
  std::vector<FoundRoom> rooms = {RoomOfPlaces(0, 1), RoomOfPlaces(1, 2)};
  tracker.Track(places, &rooms);
  std::vector<FoundRoom> swapped = {RoomOfPlaces(1, 2), RoomOfPlaces(0, 1)};
  tracker.Track(places, &swapped);
  EXPECT_EQ(swapped[0].id, rooms[1].id);
  EXPECT_EQ(swapped[1].id, rooms[0].id);
}

TEST(RoomTracker, ForgetsRoomsThatAreGone) {
  RoomTracker tracker;
  std::vector<FoundRoom> rooms = {RoomOfPlaces(0, 3)};
  tracker.Track(Places(3), &rooms);
  std::vector<FoundRoom> none;
  tracker.Track({}, &none);
  std::vector<FoundRoom> again = {RoomOfPlaces(0, 3)};
  tracker.Track(Places(3), &again);
  EXPECT_EQ(again[0].id, 1);
}

}  // namespace
}  // namespace dsg::ingest
