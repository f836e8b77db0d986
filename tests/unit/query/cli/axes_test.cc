// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/axes.h"

#include <gtest/gtest.h>

#include <vector>

#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

TEST(Axes, TicksAreRoundMetres) {
  EXPECT_EQ(TicksOf(-0.4, 3.2, 0.9), (std::vector<double>{0.0, 1.0, 2.0, 3.0}));
  EXPECT_EQ(TicksOf(-7.0, 7.0, 3.1), (std::vector<double>{-5.0, 0.0, 5.0}));
  EXPECT_EQ(TicksOf(0.05, 0.5, 0.13), (std::vector<double>{0.2, 0.4}));
  EXPECT_EQ(TicksOf(990.0, 1110.0, 51.0), (std::vector<double>{1000.0, 1100.0}));
  EXPECT_EQ(TicksOf(1.0, 2.0, 1.0), (std::vector<double>{1.0, 2.0}));
  EXPECT_TRUE(TicksOf(0.1, 0.2, 5.0).empty());
}

TEST(Axes, RoundLengthsBelow) {
  EXPECT_EQ(RoundBelow(1.0), 1.0);
  EXPECT_EQ(RoundBelow(4.9), 2.0);
  EXPECT_EQ(RoundBelow(70.0), 50.0);
  EXPECT_DOUBLE_EQ(RoundBelow(0.03), 0.02);
}

bool IsInk(const picture::Picture& picture, int x, int y) {
  const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
  return picture.rgb[i] < 160;
}

// Four metres on 400 pixels of the canvas, which is halved.
TEST(Axes, TicksStandAtTheirMetres) {
  picture::Canvas canvas(600, 600, picture::MakePaint(kPaperRgb));
  const FloorView view(Eigen::AlignedBox2d(Eigen::Vector2d(-1.0, 10.0), Eigen::Vector2d(3.0, 14.0)),
                       Eigen::AlignedBox2d(Eigen::Vector2d(100, 100), Eigen::Vector2d(500, 500)));
  DrawAxes(view, &canvas);
  const picture::Picture picture = canvas.Halved();
  // Steps of 2 m: 100 pixels a metre are less than labels need.
  for (const int x : {100, 200}) EXPECT_TRUE(IsInk(picture, x, 253)) << "x tick at " << x;
  for (const int x : {60, 150, 240}) EXPECT_FALSE(IsInk(picture, x, 253)) << "no x tick at " << x;
  for (const int y : {50, 150, 250}) EXPECT_TRUE(IsInk(picture, 47, y)) << "y tick at " << y;
  EXPECT_FALSE(IsInk(picture, 47, 100));
}

}  // namespace
}  // namespace dsg::cli
