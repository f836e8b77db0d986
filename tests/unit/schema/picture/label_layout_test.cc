// SPDX-License-Identifier: Apache-2.0
// Spots are given once, whatever their size and order.
#include "schema/picture/font.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/random.h"

namespace dsg::picture {
namespace {

using Box = Eigen::AlignedBox2d;
using Vector = Eigen::Vector2d;

bool Overlap(const Box& a, const Box& b) {
  return a.min().x() < b.max().x() && b.min().x() < a.max().x() && a.min().y() < b.max().y() &&
         b.min().y() < a.max().y();
}

TEST(LabelLayout, RefusesASpotThatTouchesAnotherOrLeavesTheArea) {
  LabelLayout layout(Box(Vector(100, 100), Vector(400, 300)));
  layout.Block(Box(Vector(150, 150), Vector(250, 170)));
  EXPECT_FALSE(layout.IsFree(Box(Vector(240, 160), Vector(300, 180))));
  EXPECT_TRUE(layout.IsFree(Box(Vector(250, 150), Vector(300, 170))));
  EXPECT_FALSE(layout.IsFree(Box(Vector(90, 200), Vector(120, 210))));
  EXPECT_FALSE(layout.IsFree(Box(Vector(390, 290), Vector(390, 310))));
}

TEST(LabelLayout, SaysTheSameAsComparingAllSpots) {
  const Box area(Vector(0, 0), Vector(1000, 700));
  LabelLayout layout(area);
  std::vector<Box> placed;
  Random random(1, 0);
  for (int i = 0; i < 3000; ++i) {
    const Vector low(random.Uniform(-50.0, 1000.0), random.Uniform(-50.0, 700.0));
    const Box spot(low, low + Vector(random.Uniform(1.0, 200.0), random.Uniform(1.0, 40.0)));
    const bool is_free =
        area.contains(spot) && std::none_of(placed.begin(), placed.end(),
                                            [&](const Box& other) { return Overlap(spot, other); });
    ASSERT_EQ(layout.IsFree(spot), is_free);
    if (!is_free) continue;
    layout.Block(spot);
    placed.push_back(spot);
  }
  EXPECT_GT(placed.size(), 50u);
}

}  // namespace
}  // namespace dsg::picture
