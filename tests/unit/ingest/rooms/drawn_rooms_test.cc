// SPDX-License-Identifier: Apache-2.0
// Rooms of storeys drawn by hand, each with one difficulty.
#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <string>
#include <variant>

#include "ingest/rooms/outline.h"
#include "tests/unit/ingest/rooms/rooms_test_util.h"

namespace dsg::ingest {
namespace {

constexpr double kCeilingM = 2.8;
constexpr double kDoorM = 2.1;

/// A storey with places half a metre apart.
struct Example {
  explicit Example(const DrawnStorey& storey, double spacing_m = 0.5) : field(storey.grid()) {
    input = InputOf(field, storey.ceiling_m());
    AddPlaces(spacing_m, &input);
  }
  RoomLabelling Find(RoomMethod method = RoomMethod::kAuto) const {
    RoomOptions options;
    options.method = method;
    return FindRooms(input, options).best;
  }
  int RoomAt(const RoomLabelling& rooms, double x, double y) const {
    int best = -1;
    double best_m = 1.0;
    for (size_t i = 0; i < input.places.size(); ++i) {
      const double m = (input.places[i].position_map.head<2>() - Eigen::Vector2d(x, y)).norm();
      if (m >= best_m) continue;
      best_m = m;
      best = rooms.room_of_place[i];
    }
    return best;
  }

  DistanceField field;
  RoomInput input;
};

/// Two rooms of 5 m x 4 m side by side, wall at x = 5.2 to 5.4.
DrawnStorey TwoRooms() {
  DrawnStorey storey(10.8, 4.6, kCeilingM);
  storey.Carve({0.2, 0.2}, {5.2, 4.2});
  storey.Carve({5.4, 0.2}, {10.4, 4.2});
  return storey;
}

constexpr RoomMethod kMethods[] = {RoomMethod::kAuto, RoomMethod::kCeiling, RoomMethod::kClearance};

TEST(Rooms, AreNoneInAnEmptyMap) {
  const DistanceField nothing;
  RoomInput input;
  EXPECT_TRUE(FindRooms(input, {}).best.rooms.empty());
  input.field = &nothing;
  input.places.resize(2);
  const RoomResult result = FindRooms(input, {});
  EXPECT_TRUE(result.best.rooms.empty());
  EXPECT_EQ(result.best.room_of_place, (std::vector<int>{-1, -1}));
}

TEST(Rooms, OfOneRoomAreOne) {
  DrawnStorey storey(5.4, 4.4, kCeilingM);
  storey.Carve({0.2, 0.2}, {5.2, 4.2});
  const Example example(storey);
  for (const RoomMethod method : kMethods) {
    const RoomLabelling rooms = example.Find(method);
    ASSERT_EQ(rooms.rooms.size(), 1u);
    EXPECT_EQ(rooms.rooms[0].places.size(), example.input.places.size());
    EXPECT_NEAR(rooms.rooms[0].area_m2, 20.0, 0.5);
    EXPECT_NEAR(rooms.rooms[0].z_max_m, kCeilingM, 0.1);
    EXPECT_GT(SignedArea(rooms.rooms[0].footprint_map), 0.0);
    EXPECT_TRUE(rooms.adjacent.empty());
  }
}

TEST(Rooms, PartAtADoorWithALintel) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.2}, {5.4, 2.3}, kDoorM);
  const Example example(storey);
  for (const RoomMethod method : kMethods) {
    const RoomLabelling rooms = example.Find(method);
    ASSERT_EQ(rooms.rooms.size(), 2u);
    EXPECT_NE(example.RoomAt(rooms, 1, 1), example.RoomAt(rooms, 9, 1));
    EXPECT_EQ(rooms.adjacent, (std::vector<std::pair<int, int>>{{0, 1}}));
  }
}

TEST(Rooms, PartAtAnOpeningAsHighAsTheCeiling) {
  for (const double width_m : {1.0, 1.6, 2.4}) {
    DrawnStorey storey = TwoRooms();
    storey.Carve({5.2, 2.2 - 0.5 * width_m}, {5.4, 2.2 + 0.5 * width_m});
    const Example example(storey);
    for (const RoomMethod method : kMethods) {
      EXPECT_EQ(example.Find(method).rooms.size(), 2u) << width_m;
    }
  }
}

TEST(PaperRooms, PartAtADoorWithALintelAndAtNothingElse) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.2}, {5.4, 2.3}, kDoorM);
  const Example example(storey);
  const RoomLabelling rooms = example.Find(RoomMethod::kPaper);
  ASSERT_EQ(rooms.rooms.size(), 2u);
  EXPECT_EQ(rooms.adjacent, (std::vector<std::pair<int, int>>{{0, 1}}));
  // The vote gives places in the doorway a room too.
  for (const int room : rooms.room_of_place) EXPECT_GE(room, 0);
  // The pieces end 0.2 m before the walls.
  EXPECT_NEAR(rooms.rooms[0].area_m2, 4.6 * 3.6, 1.0);
  storey.Carve({5.2, 1.2}, {5.4, 2.3});
  EXPECT_EQ(Example(storey).Find(RoomMethod::kPaper).rooms.size(), 1u) << "as high as the ceiling";
  EXPECT_EQ(Example(storey).Find(RoomMethod::kAuto).rooms.size(), 2u);
}

TEST(PaperRooms, PartAtOpeningsNoWiderThanTwiceTheDistance) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.2}, {5.4, 1.5});
  EXPECT_EQ(Example(storey).Find(RoomMethod::kPaper).rooms.size(), 2u);
}

TEST(PaperRooms, AreNoneWithoutACeiling) {
  const Example seen(TwoRooms());
  RoomInput input = seen.input;
  input.ceiling_z_m.reset();
  RoomOptions options;
  options.method = RoomMethod::kPaper;
  EXPECT_TRUE(FindRooms(input, options).best.rooms.empty());
  // Above all that was seen.
  input.ceiling_z_m = 1000.0;
  EXPECT_TRUE(FindRooms(input, options).best.rooms.empty());
}

TEST(Rooms, AreOneWhereAWallIsMostlyMissing) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 0.6}, {5.4, 3.8});
  for (const RoomMethod method : kMethods) {
    EXPECT_EQ(Example(storey).Find(method).rooms.size(), 1u);
  }
}

TEST(Rooms, OfAnLShapeAreOne) {
  DrawnStorey storey(8.4, 8.4, kCeilingM);
  storey.Carve({0.2, 0.2}, {8.2, 3.2});
  storey.Carve({0.2, 0.2}, {3.2, 8.2});
  for (const RoomMethod method : kMethods) {
    EXPECT_EQ(Example(storey).Find(method).rooms.size(), 1u);
  }
}

TEST(Rooms, OfANetOfCorridorsAreItsArmsOrTheWhole) {
  DrawnStorey storey(24.4, 14.4, kCeilingM);
  storey.Carve({0.2, 6.2}, {24.2, 8.2});
  storey.Carve({11.2, 8.2}, {13.2, 14.2});
  const Example example(storey);
  const RoomLabelling arms = example.Find();
  EXPECT_EQ(arms.rooms.size(), 3u);
  EXPECT_NE(example.RoomAt(arms, 2, 7), example.RoomAt(arms, 22, 7));
  EXPECT_NE(example.RoomAt(arms, 2, 7), example.RoomAt(arms, 12.2, 13));
  RoomOptions options;
  options.split_corridors = false;
  EXPECT_EQ(FindRooms(example.input, options).best.rooms.size(), 1u);
  // Corridors 2 m wide are halls for whom they are.
  options = {};
  options.corridors.width_m_max = 1.9;
  EXPECT_EQ(FindRooms(example.input, options).best.rooms.size(), 1u);
}

TEST(RoomOptions, GiveEachPlaceOneRoomAtBothEndsOfTheirRanges) {
  const Example example(TwoRooms());
  RoomOptions options;
  for (const BoundOption& field : options.Bind()) {
    const double before = field.Get();
    for (const double value : {field.min, field.max}) {
      field.Set(value);
      for (const RoomMethod method : {RoomMethod::kAuto, RoomMethod::kCeiling,
                                      RoomMethod::kClearance, RoomMethod::kFiltration}) {
        options.method = method;
        const RoomLabelling found = FindRooms(example.input, options).best;
        ASSERT_EQ(found.room_of_place.size(), example.input.places.size()) << field.name;
        size_t count = 0;
        for (const FoundRoom& room : found.rooms) count += room.places.size();
        for (const int room : found.room_of_place) {
          EXPECT_LT(room, static_cast<int>(found.rooms.size())) << field.name;
          count -= room >= 0 ? 1 : 0;
        }
        EXPECT_EQ(count, 0u) << field.name << " " << value;
      }
    }
    field.Set(before);
  }
}

TEST(RoomOptions, AreInRangeAndHaveNamesOfTheirOwn) {
  EXPECT_TRUE(ValidateOptions(RoomOptions()).ok());
  EXPECT_TRUE(ValidateOptions(StructureOptions()).ok());
  RoomOptions rooms;
  StructureOptions structures;
  std::vector<BoundOption> bound = rooms.Bind();
  const std::vector<BoundOption> more = structures.Bind();
  bound.insert(bound.end(), more.begin(), more.end());
  std::set<std::string> names;
  std::set<std::variant<double*, int*, TimeNs*>> numbers;
  for (const BoundOption& field : bound) {
    names.insert(field.name);
    numbers.insert(field.value);
    const double before = field.Get();
    field.Set(field.max + 1.0);
    const bool is_refused = !ValidateOptions(rooms).ok() || !ValidateOptions(structures).ok();
    EXPECT_TRUE(is_refused) << field.name;
    field.Set(before);
  }
  EXPECT_EQ(names.size(), bound.size());
  EXPECT_EQ(numbers.size(), bound.size());
  // Each number has its row.
  EXPECT_EQ(more.size() * sizeof(double), sizeof(StructureOptions));
  EXPECT_EQ((bound.size() - more.size()) * sizeof(double),
            sizeof(RoomOptions) - offsetof(RoomOptions, section_clearance_m));
}

TEST(Rooms, OfAStraightCorridorAreOneWhateverOpensFromIt) {
  DrawnStorey storey(20.4, 7.4, kCeilingM);
  storey.Carve({0.2, 0.2}, {20.2, 2.2});
  for (int i = 0; i < 4; ++i) {
    const double x = 0.2 + 5.0 * i;
    storey.Carve({x, 2.4}, {x + 4.8, 7.2});
    storey.Carve({x + 2.0, 2.2}, {x + 3.0 + 0.4 * i, 2.4}, i % 2 == 0 ? kDoorM : kCeilingM);
  }
  for (const RoomMethod method : kMethods) {
    const RoomLabelling rooms = Example(storey).Find(method);
    EXPECT_EQ(rooms.rooms.size(), 5u);
    EXPECT_EQ(rooms.adjacent.size(), 4u);
  }
}

TEST(Rooms, AreNotPartedByFurniture) {
  DrawnStorey storey(6.4, 5.4, kCeilingM);
  storey.Carve({0.2, 0.2}, {6.2, 5.2});
  // A row of shelves with a way round, a table with chairs, a wardrobe.
  storey.Fill({3.0, 0.2}, {3.4, 3.8}, 0.0, 2.0);
  storey.Fill({4.2, 2.0}, {5.4, 2.8}, 0.7, 0.8);
  storey.Fill({0.2, 3.2}, {0.8, 5.2}, 0.0, 2.0);
  EXPECT_EQ(Example(storey).Find(RoomMethod::kCeiling).rooms.size(), 1u);
  EXPECT_EQ(Example(storey).Find(RoomMethod::kAuto).rooms.size(), 1u);
}

TEST(Rooms, MayBeLowerThanTheirNeighbours) {
  DrawnStorey storey(10.8, 4.6, 3.0);
  storey.Carve({0.2, 0.2}, {5.2, 4.2}, 2.5);
  storey.Carve({5.4, 0.2}, {10.4, 4.2});
  storey.Carve({5.2, 1.5}, {5.4, 2.5}, kDoorM);
  const Example example(storey);
  const RoomLabelling rooms = example.Find(RoomMethod::kCeiling);
  ASSERT_EQ(rooms.rooms.size(), 2u);
  const int low = example.RoomAt(rooms, 2, 2);
  ASSERT_GE(low, 0);
  EXPECT_NEAR(rooms.rooms[static_cast<size_t>(low)].z_max_m, 2.5, 0.1);
  EXPECT_NEAR(rooms.rooms[static_cast<size_t>(1 - low)].z_max_m, 3.0, 0.1);
}

TEST(Rooms, AreFoundWhereNobodySawTheCeiling) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.5}, {5.4, 2.5}, kDoorM);
  storey.Hide({0.0, 0.0}, {10.8, 4.6}, 2.0, 4.0);
  Example example(storey);
  example.input.ceiling_z_m.reset();
  EXPECT_EQ(example.Find(RoomMethod::kAuto).rooms.size(), 2u);
}

TEST(Rooms, AreFoundWhereOnlyOneCeilingWasSeen) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.5}, {5.4, 2.5}, kDoorM);
  storey.Hide({5.0, 0.0}, {10.8, 4.6}, 2.0, 4.0);
  EXPECT_EQ(Example(storey).Find(RoomMethod::kAuto).rooms.size(), 2u);
}

TEST(Rooms, EndWhereNobodyHasBeen) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.5}, {5.4, 2.5}, kDoorM);
  storey.Hide({7.0, 0.0}, {10.8, 4.6}, -1.0, 4.0);
  const RoomLabelling rooms = Example(storey).Find(RoomMethod::kAuto);
  ASSERT_EQ(rooms.rooms.size(), 2u);
  double east_m = 0.0;
  for (const FoundRoom& room : rooms.rooms) {
    for (const Eigen::Vector2d& corner : room.footprint_map) {
      east_m = std::max(east_m, corner.x());
    }
  }
  EXPECT_LT(east_m, 7.4);
}

TEST(Rooms, AreTheSameEachTime) {
  DrawnStorey storey = TwoRooms();
  storey.Carve({5.2, 1.5}, {5.4, 2.5}, kDoorM);
  const Example example(storey);
  const RoomLabelling first = example.Find();
  const RoomLabelling second = example.Find();
  EXPECT_EQ(first.room_of_place, second.room_of_place);
  ASSERT_EQ(first.rooms.size(), second.rooms.size());
  for (size_t i = 0; i < first.rooms.size(); ++i) {
    EXPECT_EQ(first.rooms[i].footprint_map, second.rooms[i].footprint_map);
  }
}

TEST(Rooms, CarryTheOtherMethodsWordWhenItDiffers) {
  DrawnStorey storey(8.4, 5.4, kCeilingM);
  storey.Carve({0.2, 0.2}, {8.2, 5.2});
  // Shelves up to 2 m look like a wall with a door to who does not see the ceiling.
  storey.Fill({4.0, 0.2}, {4.2, 2.2}, 0.0, 2.0);
  storey.Fill({4.0, 3.2}, {4.2, 5.2}, 0.0, 2.0);
  const Example example(storey);
  const RoomResult result = FindRooms(example.input, {});
  EXPECT_EQ(result.best.rooms.size(), 1u);
  ASSERT_TRUE(result.alternative.has_value());
  EXPECT_EQ(result.alternative->method, RoomMethod::kClearance);
  EXPECT_EQ(result.alternative->rooms.size(), 2u);
}

}  // namespace
}  // namespace dsg::ingest
