// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "ingest/rooms/room_class.h"

namespace dsg::ingest {
namespace {

std::string Best(const RoomContents& contents) {
  const std::map<std::string, double> classes = ClassifyRoom(contents);
  const auto most =
      std::max_element(classes.begin(), classes.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == classes.end() ? "" : most->first;
}

TEST(RoomClass, IsToldByFurniture) {
  EXPECT_EQ(Best({{"fridge", "counter", "microwave", "table", "chair", "chair"}, 20.0}), "kitchen");
  EXPECT_EQ(Best({{"bed", "wardrobe", "nightstand"}, 15.0}), "bedroom");
  EXPECT_EQ(Best({{"toilet", "toilet", "washbasin", "washbasin", "bin"}, 15.0}), "restroom");
  EXPECT_EQ(Best({{"toilet", "washbasin", "bathtub"}, 8.0}), "bathroom");
  EXPECT_EQ(Best({{"desk", "desk", "chair", "chair", "laptop", "laptop", "shelf", "bin"}, 22.0}),
            "office");
  EXPECT_EQ(Best({{"table", "chair", "chair", "chair", "chair", "chair", "chair", "whiteboard",
                   "tv", "tv stand"},
                  30.0}),
            "meeting room");
  EXPECT_EQ(Best({{"printer", "printer", "cabinet", "bin"}, 14.0}), "copy room");
  EXPECT_EQ(Best({{"shelf", "shelf", "shelf", "cabinet"}, 14.0}), "storage room");
}

TEST(RoomClass, KnowsOtherNamesOfTheSameThings) {
  EXPECT_EQ(ClassifyRoom({{"refrigerator", "Sofa_2", "office chair"}, 20.0}),
            ClassifyRoom({{"fridge", "couch", "chair"}, 20.0}));
}

TEST(RoomClass, TellsACorridorByItsShapeAndDoors) {
  EXPECT_EQ(Best({{}, 60.0, 12.0, 9}), "corridor");
  EXPECT_EQ(Best({{"plant", "bin", "picture"}, 60.0, 12.0, 9}), "corridor");
}

TEST(RoomClass, SaysNothingAboutAnEmptyRoom) {
  EXPECT_TRUE(ClassifyRoom({}).empty());
  EXPECT_TRUE(ClassifyRoom({{"human", "unheard-of"}, 20.0, 1.3, 1}).empty());
}

TEST(BuildingClass, IsToldByItsRooms) {
  const auto bedroom = ClassifyRoom({{"bed", "wardrobe", "nightstand"}, 15.0});
  const auto kitchen = ClassifyRoom({{"fridge", "counter", "microwave"}, 20.0});
  const auto office = ClassifyRoom({{"desk", "desk", "chair", "chair", "laptop", "laptop"}, 22.0});
  EXPECT_GT(ClassifyBuilding({bedroom, kitchen, {}}).at("house"), 0.7);
  EXPECT_GT(ClassifyBuilding({office, office, office, kitchen}).at("office"), 0.9);
  // A house with a room to work in.
  EXPECT_GT(ClassifyBuilding({bedroom, bedroom, office}).at("house"), 0.5);
  const auto both = ClassifyBuilding({bedroom, office});
  EXPECT_NEAR(both.at("house") + both.at("office"), 1.0, 1e-12);
}

TEST(BuildingClass, IsNotGuessed) {
  EXPECT_TRUE(ClassifyBuilding({}).empty());
  EXPECT_TRUE(ClassifyBuilding({{}, {}}).empty());
  EXPECT_TRUE(ClassifyBuilding({{{"kitchen", 1.0}}, {{"corridor", 1.0}}}).empty());
}

TEST(RoomClass, AddsUpToOne) {
  double sum = 0.0;
  for (const auto& [name, probability] : ClassifyRoom({{"desk"}, 20.0, 1.3, 1})) {
    EXPECT_GE(probability, 0.0) << name;
    sum += probability;
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

}  // namespace
}  // namespace dsg::ingest
