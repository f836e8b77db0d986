// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/rooms.h"

#include <gtest/gtest.h>

namespace dsg::evaluation {
namespace {

// Three rooms of 4 x 4 m in a row, doors between neighbours at y = 1 to 2.
truth::FreeGrid Grid() {
  truth::FreeGrid grid;
  grid.cell_m = 0.2;
  grid.width = 60;
  grid.height = 20;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      const bool is_door = ((x >= 18 && x < 22) || (x >= 38 && x < 42)) && y >= 5 && y < 10;
      grid.cells.push_back(static_cast<uint8_t>(truth::kCellFree | truth::kCellObserved |
                                                (is_door ? truth::kCellDoorBand : 0)));
    }
  }
  return grid;
}

TrueRooms RoomTruth() {
  TrueRooms truth;
  for (double x = 0.0; x < 12.0; x += 4.0) {
    truth.footprints_map.push_back({{x, 0}, {x + 4, 0}, {x + 4, 4}, {x, 4}});
  }
  truth.doors = {{0, 1}, {1, 2}};
  return truth;
}

// Places every half metre; 64 a room.
PredictedRooms PerfectRooms() {
  PredictedRooms predicted;
  predicted.count = 3;
  for (double x = 0.25; x < 12.0; x += 0.5) {
    for (double y = 0.25; y < 4.0; y += 0.5) {
      predicted.places.push_back({{x, y, 1.0}, 0.24, static_cast<int>(x / 4.0)});
    }
  }
  predicted.adjacent = {{1, 0}, {1, 2}, {2, 1}};
  return predicted;
}

RoomResult ScoreRooms(const PredictedRooms& predicted) {
  const truth::FreeGrid grid = Grid();
  const GridMap map(&grid);
  return EvaluateRooms(predicted, RoomTruth(), map, {});
}

TEST(RoomMetric, IsPerfectForTheTruthItself) {
  const RoomResult result = ScoreRooms(PerfectRooms());
  for (const PrecisionRecall& score : {result.of_places, result.outside_doors, result.one_to_one}) {
    EXPECT_DOUBLE_EQ(*score.precision, 1.0);
    EXPECT_DOUBLE_EQ(*score.recall, 1.0);
  }
  EXPECT_GT(*result.volumetric.precision, 0.97);
  EXPECT_GT(*result.volumetric.recall, 0.6);
  EXPECT_EQ(result.count, 3);
  EXPECT_EQ(result.count_truth, 3);
  EXPECT_DOUBLE_EQ(*result.adjacency_f1, 1.0);
}

TEST(RoomMetric, LosesPrecisionByMergedRooms) {
  PredictedRooms merged = PerfectRooms();
  for (RoomPlace& place : merged.places) place.room = place.room == 2 ? 1 : 0;
  merged.count = 2;
  merged.adjacent = {{0, 1}};
  const RoomResult result = ScoreRooms(merged);
  EXPECT_NEAR(*result.of_places.precision, (0.5 + 0.5 + 1.0) / 3.0, 1e-12);
  EXPECT_DOUBLE_EQ(*result.of_places.recall, 1.0);
  EXPECT_NEAR(*result.one_to_one.recall, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(*result.one_to_one.precision, 0.75, 1e-12);
  EXPECT_EQ(result.count, 2);
  EXPECT_LT(*result.adjacency_f1, 0.7);
  EXPECT_LT(*result.volumetric.precision, 0.8);
}

TEST(RoomMetric, LosesRecallBySplitRooms) {
  PredictedRooms split = PerfectRooms();
  for (RoomPlace& place : split.places) {
    if (place.room == 1 && place.position_map.y() > 2.0) place.room = 3;
  }
  split.count = 4;
  const RoomResult result = ScoreRooms(split);
  EXPECT_DOUBLE_EQ(*result.of_places.precision, 1.0);
  EXPECT_NEAR(*result.of_places.recall, (1.0 + 0.5 + 1.0) / 3.0, 1e-12);
  // The paper's average does not see the fourth room, the one-to-one variant does.
  EXPECT_NEAR(*result.one_to_one.precision, 0.75, 1e-12);
  EXPECT_EQ(result.count, 4);
}

TEST(RoomMetric, TellsMistakesAtDoorsFromOthers) {
  PredictedRooms shifted = PerfectRooms();
  for (RoomPlace& place : shifted.places) {
    const bool is_at_door = place.position_map.x() > 4.0 && place.position_map.x() < 4.3 &&
                            place.position_map.y() > 1.0 && place.position_map.y() < 2.0;
    if (is_at_door) place.room = 0;
  }
  const RoomResult result = ScoreRooms(shifted);
  EXPECT_LT(*result.of_places.precision, 1.0);
  EXPECT_LT(*result.of_places.recall, 1.0);
  EXPECT_DOUBLE_EQ(*result.outside_doors.precision, 1.0);
  EXPECT_DOUBLE_EQ(*result.outside_doors.recall, 1.0);
}

TEST(RoomMetric, IsBadWhenLabelsAreShuffledAmongPlaces) {
  PredictedRooms shuffled = PerfectRooms();
  for (size_t i = 0; i < shuffled.places.size(); ++i) {
    shuffled.places[i].room = static_cast<int>(i % 3);
  }
  const RoomResult result = ScoreRooms(shuffled);
  EXPECT_LT(*result.of_places.precision, 0.45);
  EXPECT_LT(*result.of_places.recall, 0.45);
  EXPECT_LT(*result.one_to_one.recall, 0.45);
}

TEST(RoomMetric, PunishesARoomWithoutPlacesAndPlacesWithoutARoom) {
  PredictedRooms missing = PerfectRooms();
  for (RoomPlace& place : missing.places) {
    if (place.room == 2) place.room = -1;
  }
  EXPECT_NEAR(*ScoreRooms(missing).of_places.recall, 2.0 / 3.0, 1e-12);
  std::erase_if(missing.places, [](const RoomPlace& place) { return place.room < 0; });
  EXPECT_NEAR(*ScoreRooms(missing).of_places.recall, 2.0 / 3.0, 1e-12);
}

TEST(RoomMetric, DoesNotAskForARoomThatNobodySaw) {
  truth::FreeGrid grid = Grid();
  for (int y = 0; y < 20; ++y) {
    for (int x = 40; x < 60; ++x) {
      grid.cells[static_cast<size_t>(60 * y + x)] &= static_cast<uint8_t>(~truth::kCellObserved);
    }
  }
  PredictedRooms seen = PerfectRooms();
  std::erase_if(seen.places, [](const RoomPlace& place) { return place.room == 2; });
  seen.count = 2;
  seen.adjacent = {{0, 1}};
  const GridMap map(&grid);
  const RoomResult result = EvaluateRooms(seen, RoomTruth(), map, {});
  EXPECT_EQ(result.count_truth, 2);
  EXPECT_DOUBLE_EQ(*result.of_places.recall, 1.0);
  EXPECT_DOUBLE_EQ(*result.adjacency_f1, 1.0);
}

TEST(RoomMetric, CountsADoorThatIsNotThere) {
  PredictedRooms wrong = PerfectRooms();
  wrong.adjacent = {{0, 1}, {0, 2}};
  EXPECT_DOUBLE_EQ(*ScoreRooms(wrong).adjacency_f1, 0.5);
  wrong.adjacent.clear();
  EXPECT_FALSE(ScoreRooms(wrong).adjacency_f1.has_value());
}

TEST(RoomMetric, IsEmptyWithoutRooms) {
  PredictedRooms none = PerfectRooms();
  none.count = 0;
  for (RoomPlace& place : none.places) place.room = -1;
  const RoomResult result = ScoreRooms(none);
  EXPECT_FALSE(result.of_places.precision.has_value());
  EXPECT_FALSE(result.count.has_value());
  EXPECT_EQ(result.count_truth, 3);
}

}  // namespace
}  // namespace dsg::evaluation
