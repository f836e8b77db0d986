// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/carried_things.h"

#include <gtest/gtest.h>

#include "tests/unit/ingest/objects/made_picture.h"

namespace dsg::ingest {
namespace {

constexpr TimeNs kPeriodNs = kNsPerSecond / 5;

SmallSighting Held(int32_t class_id, const Eigen::Vector3d& center_map) {
  SmallSighting seen;
  seen.class_id = class_id;
  seen.center_map = center_map;
  seen.span_m = 0.1;
  seen.is_held = true;
  return seen;
}

TEST(CarriedThings, AreThoseThatMove) {
  CarriedThings things;
  for (int i = 0; i < 8; ++i) {
    things.See({Held(kBook, {0, 0.01 * i, 0.8}), Held(kCup, {0.2 * i, 0, 1})}, i * kPeriodNs);
  }
  const auto carries = things.Carries();
  ASSERT_EQ(carries.size(), 1u);
  EXPECT_EQ(carries[0].class_id, kCup);
  EXPECT_EQ(carries[0].way.size(), 8u);
  EXPECT_EQ(carries[0].way.back().time_ns, 7 * kPeriodNs);
}

TEST(CarriedThings, AreNotThoseThatNobodyTouches) {
  CarriedThings things;
  for (int i = 0; i < 8; ++i) {
    SmallSighting seen = Held(kCup, {0.2 * i, 0, 1});
    seen.is_held = false;
    things.See({seen}, i * kPeriodNs);
  }
  EXPECT_TRUE(things.Carries().empty());
}

TEST(CarriedThings, AreNotTwoOnATableThatSomebodyWalksBy) {
  CarriedThings things;
  for (int i = 0; i < 3; ++i) things.See({Held(kCup, {0, 0, 0.8})}, i * kPeriodNs);
  for (int i = 3; i < 6; ++i) things.See({Held(kCup, {0.4, 0, 0.8})}, i * kPeriodNs);
  EXPECT_TRUE(things.Carries().empty());
}

TEST(CarriedThings, AreToldApartByWhereTheyWere) {
  CarriedThings things;
  for (int i = 0; i < 8; ++i) {
    things.See({Held(kCup, {4 - 0.2 * i, 0, 1}), Held(kCup, {0.2 * i, 2, 1})}, i * kPeriodNs);
  }
  const auto carries = things.Carries();
  ASSERT_EQ(carries.size(), 2u);
  for (const Carry& carry : carries) {
    EXPECT_DOUBLE_EQ(carry.way.front().position_map.y(), carry.way.back().position_map.y());
  }
}

TEST(CarriedThings, AreSeenInPictures) {
  CarriedThings things;
  const Pose3d camera = LookAt({3, 0, 1.3}, {0, 0, 1});
  for (int i = 0; i < 8; ++i) {
    const double y = 0.15 * i - 0.5;
    const MadeBox body = MakeBox(kPerson, 1, {-0.15, y, 0}, {0.2, 0.4, 1.7});
    const DepthFrame frame =
        MakePicture(i * kPeriodNs, camera, {body, MakeCup(1, {0.0, y + 0.15, 1.0})});
    things.See(FindSmallSightings(frame, {kTable, kCup}), frame.time_ns);
  }
  const auto carries = things.Carries();
  ASSERT_EQ(carries.size(), 1u);
  EXPECT_EQ(carries[0].class_id, kCup);
  EXPECT_NEAR(carries[0].way.back().position_map.y(), 0.7, 0.05);
}

}  // namespace
}  // namespace dsg::ingest
