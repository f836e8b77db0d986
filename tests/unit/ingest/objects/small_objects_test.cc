// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/small_objects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/unit/ingest/objects/made_picture.h"

namespace dsg::ingest {
namespace {

const std::vector<int32_t> kClasses = {kTable, kCup, kBook};
const Eigen::Vector3d kMiddle(0, 0, 0.75);

// A camera walks by a table, 1.6 m away.
class SmallThings : public testing::Test {
 protected:
  Pose3d Camera() const {
    const double turn = 0.03 * static_cast<double>(picture_);
    return LookAt({1.6 * std::cos(turn), 1.6 * std::sin(turn), 1.3}, kMiddle);
  }

  void Look(const DepthFrame& frame) { things_.See(frame, FindSmallSightings(frame, kClasses)); }

  void See(const std::vector<MadeBox>& boxes) {
    frame_ = MakePicture(picture_ * kNsPerSecond / 5, Camera(), boxes);
    Look(frame_);
    ++picture_;
  }

  void See(int count, const std::vector<MadeBox>& boxes) {
    for (int i = 0; i < count; ++i) See(boxes);
  }

  std::vector<ObjectCluster> Found() const {
    std::vector<ObjectCluster> clusters;
    things_.Place(&clusters);
    return clusters;
  }

  SmallObjects things_;
  DepthFrame frame_;
  int picture_ = 0;
};

TEST_F(SmallThings, AreFoundWhereTheyStand) {
  See(10, {MakeTable(), MakeCup(1, {0.2, 0.1, 0.75})});
  const auto found = Found();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].class_id, kCup);
  EXPECT_LT((found[0].center_map - Eigen::Vector3d(0.2, 0.1, 0.79)).norm(), 0.03)
      << found[0].center_map.transpose() << ", " << found[0].size.transpose();
  EXPECT_NEAR(found[0].size.z(), 0.08, 0.02);
  EXPECT_EQ(found[0].first_seen_ns, 0);
  EXPECT_EQ(found[0].last_seen_ns, 9 * kNsPerSecond / 5);
}

TEST_F(SmallThings, AreFoundAmongReadingsOfNoSense) {
  for (int i = 0; i < 10; ++i) {
    frame_ = MakePicture(picture_ * kNsPerSecond / 5, Camera(),
                         {MakeTable(), MakeCup(1, {0.2, 0.1, 0.75})});
    ++picture_;
    for (size_t pixel = 0; pixel < frame_.depth_m.size(); pixel += 7) {
      frame_.depth_m[pixel] = pixel % 2 == 0 ? std::numeric_limits<float>::max() : 3e7F;
    }
    Look(frame_);
  }
  const auto found = Found();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].center_map - Eigen::Vector3d(0.2, 0.1, 0.79)).norm(), 0.03);
}

TEST_F(SmallThings, AreNotBelievedAtOnce) {
  See(7, {MakeTable()});
  See(3, {MakeTable(), MakeCup(1, {0.2, 0.1, 0.75})});
  EXPECT_TRUE(Found().empty());
}

TEST_F(SmallThings, AreKeptApartAt15Centimetres) {
  for (int i = 0; i < 10; ++i) {
    // Instances get other numbers in each picture.
    See({MakeTable(), MakeCup(1 + i % 2, {0, 0, 0.75}), MakeCup(2 - i % 2, {0, 0.15, 0.75})});
  }
  const auto found = Found();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR((found[0].center_map - found[1].center_map).norm(), 0.15, 0.03);
}

TEST_F(SmallThings, AreKeptApartWithoutInstancesToo) {
  See(10, {MakeTable(), MakeCup(0, {0, 0, 0.75}), MakeCup(0, {0, 0.15, 0.75})});
  EXPECT_EQ(Found().size(), 2u);
}

TEST_F(SmallThings, TakeThePlaceOfTheClusterThatTheyAreIn) {
  See(10, {MakeTable(), MakeCup(1, {0, 0, 0.75}), MakeCup(2, {0, 0.15, 0.75})});
  ObjectCluster lump;
  lump.class_id = kCup;
  lump.instance_id = 7;
  lump.map_T_box.position = lump.center_map = Eigen::Vector3d(0, 0.08, 0.8);
  lump.size = Eigen::Vector3d(0.2, 0.3, 0.15);
  ObjectCluster elsewhere = lump;
  elsewhere.map_T_box.position = elsewhere.center_map = Eigen::Vector3d(3, 0, 0.8);
  std::vector<ObjectCluster> clusters = {lump, elsewhere};
  things_.Place(&clusters);
  ASSERT_EQ(clusters.size(), 3u);
  EXPECT_EQ(clusters[2].instance_id, 7u);
  EXPECT_LT(clusters[0].size.maxCoeff(), 0.12);
  EXPECT_LT(clusters[1].size.maxCoeff(), 0.12);
}

TEST_F(SmallThings, AreMeasuredWhereNothingHidesThem) {
  // A box before the cup shows its upper half only.
  const MadeBox screen = MakeBox(kTable, 2, {0.3, 0, 0.75}, {0.02, 0.5, 0.1});
  See(10, {MakeTable(), MakeCup(1, {0.1, 0, 0.75}), screen});
  EXPECT_TRUE(Found().empty());
  See(10, {MakeTable(), MakeCup(1, {0.1, 0, 0.75})});
  const auto found = Found();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].center_map - Eigen::Vector3d(0.1, 0, 0.79)).norm(), 0.03);
}

TEST_F(SmallThings, AreNotFoundInSomebodysHand) {
  See(10, {MakeTable(), MakeCup(1, {0.3, -0.3, 0.75})});
  // A hand holds another cup and stands still.
  for (int i = 0; i < 10; ++i) {
    const MadeBox hand = MakeBox(kPerson, 1, {0, 0.3, 0.9}, {0.12, 0.2, 0.05});
    See({MakeTable(), MakeCup(1, {0.3, -0.3, 0.75}), MakeCup(2, {0, 0.3, 0.95}), hand});
  }
  EXPECT_EQ(Found().size(), 1u);
}

TEST_F(SmallThings, LeaveNoTrailWhenCarried) {
  See(10, {MakeTable(), MakeCup(1, {0.3, -0.3, 0.75})});
  for (int i = 0; i < 10; ++i) {
    See({MakeTable(), MakeCup(1, {0.3, -0.3, 0.75}), MakeCup(2, {0, 0.2 * i - 1.0, 1.0})});
  }
  EXPECT_EQ(Found().size(), 1u);
}

TEST_F(SmallThings, AreNotWhereTheirLabelBled) {
  const std::vector<MadeBox> boxes = {MakeTable(), MakeCup(1, {0.3, -0.3, 0.75})};
  for (int i = 0; i < 10; ++i) {
    DepthFrame frame = MakePicture(i * kNsPerSecond / 5, Camera(), boxes);
    // The mask is three pixels too far left, and runs over what is behind.
    std::vector<uint16_t> labels = frame.labels;
    for (size_t pixel = 0; pixel + 3 < labels.size(); ++pixel) {
      if (labels[pixel + 3] >> 8 == kCup) frame.labels[pixel] = labels[pixel + 3];
    }
    Look(frame);
    ++picture_;
  }
  const auto found = Found();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].center_map - Eigen::Vector3d(0.3, -0.3, 0.79)).norm(), 0.03);
  EXPECT_LT(found[0].size.maxCoeff(), 0.14);
}

TEST_F(SmallThings, AreNotSliversOfLargeOnes) {
  // Each table is large, but one of them is seen through a slit.
  const MadeBox board = MakeBox(kFloor, 1, {0.7, 0, 0.0}, {0.02, 1.6, 1.05});
  See(10, {MakeTable()});
  See(10, {MakeTable(), board});
  EXPECT_TRUE(Found().empty());
}

TEST_F(SmallThings, AreForgottenWhenGone) {
  const Eigen::Vector3d foot(0.2, 0.1, 0.75);
  See(10, {MakeTable(), MakeCup(1, foot)});
  const Box3d box(foot.array() - 0.05, foot.array() + 0.1);
  things_.Forget(kBook, box, 5 * kNsPerSecond);
  EXPECT_EQ(Found().size(), 1u);
  things_.Forget(kCup, box, kNsPerSecond);
  ASSERT_EQ(Found().size(), 1u) << "it was seen after that";
  EXPECT_EQ(Found()[0].first_seen_ns, kNsPerSecond);
  things_.Forget(kCup, box, 5 * kNsPerSecond);
  EXPECT_TRUE(Found().empty());
}

TEST_F(SmallThings, AreNotSeenWithoutLabels) {
  DepthFrame frame = MakePicture(0, Camera(), {MakeTable()});
  frame.labels.clear();
  Look(frame);
  EXPECT_TRUE(Found().empty());
}

}  // namespace
}  // namespace dsg::ingest
