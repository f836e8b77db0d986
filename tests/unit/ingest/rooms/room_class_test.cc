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
