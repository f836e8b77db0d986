// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/label_parts.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

constexpr uint16_t kCupOne = 20 << 8 | 1;

// '.' is nothing, 'a' to 'z' are instances 1 to 26 of class 20, '0' is class 20 without instance.
DepthFrame Draw(const std::vector<std::string>& rows) {
  DepthFrame frame;
  frame.camera.width = static_cast<int>(rows[0].size());
  frame.camera.height = static_cast<int>(rows.size());
  for (const std::string& row : rows) {
    for (const char pixel : row) {
      const int label = pixel == '.' ? 0 : 20 << 8 | (pixel == '0' ? 0 : pixel - 'a' + 1);
      frame.labels.push_back(static_cast<uint16_t>(label));
    }
  }
  frame.depth_m.assign(frame.labels.size(), 1.0F);
  return frame;
}

TEST(LabelParts, AreJoinedAcrossRowsAndCorners) {
  const auto parts = FindLabelParts(Draw({"a..a.", ".aa..", "....a"}), {20}, 1);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].label, kCupOne);
  EXPECT_EQ(parts[0].pixel_count, 4);
  EXPECT_EQ(parts[0].scattered_count, 1);
  EXPECT_EQ(parts[0].left, 0);
  EXPECT_EQ(parts[0].right, 3);
  EXPECT_EQ(parts[0].top, 0);
  EXPECT_EQ(parts[0].bottom, 1);
}

TEST(LabelParts, AreOneForAShapeLikeAHorseshoe) {
  EXPECT_EQ(FindLabelParts(Draw({"0...0", "0...0", "00000"}), {20}, 1).size(), 1u);
}

TEST(LabelParts, AreKeptApartByInstance) {
  EXPECT_EQ(FindLabelParts(Draw({"aabb", "aabb"}), {20}, 1).size(), 2u);
  EXPECT_EQ(FindLabelParts(Draw({"00.00"}), {20}, 1).size(), 2u) << "without instance all count";
}

TEST(LabelParts, LeaveOutOtherClassesAndSpecks) {
  EXPECT_TRUE(FindLabelParts(Draw({"aa"}), {21}, 1).empty());
  EXPECT_TRUE(FindLabelParts(Draw({"aa"}), {20}, 3).empty());
  EXPECT_TRUE(FindLabelParts(DepthFrame(), {20}, 1).empty());
}

// Flooding from each pixel finds the same parts.
TEST(LabelParts, AgreeWithFloodingOnRandomPictures) {
  Random random(7, 1);
  for (int round = 0; round < 50; ++round) {
    const int size = 12;
    std::vector<std::string> rows(size, std::string(size, '.'));
    for (std::string& row : rows) {
      for (char& pixel : row) pixel = random.Uniform() < 0.45 ? '0' : '.';
    }
    std::set<int> left;
    for (int i = 0; i < size * size; ++i) {
      if (rows[static_cast<size_t>(i / size)][static_cast<size_t>(i % size)] == '0') left.insert(i);
    }
    size_t count = 0;
    for (; !left.empty(); ++count) {
      std::vector<int> open = {*left.begin()};
      left.erase(left.begin());
      while (!open.empty()) {
        const int at = open.back();
        open.pop_back();
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            const int x = at % size + dx;
            if (x < 0 || x >= size) continue;
            const int next = at + dy * size + dx;
            if (left.erase(next) > 0) open.push_back(next);
          }
        }
      }
    }
    EXPECT_EQ(FindLabelParts(Draw(rows), {20}, 1).size(), count) << "seed 7, round " << round;
  }
}

}  // namespace
}  // namespace dsg::ingest
