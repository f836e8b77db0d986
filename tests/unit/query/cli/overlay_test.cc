// SPDX-License-Identifier: Apache-2.0
// What an answer adds to the picture of a map is there, in its colour, where it belongs.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "query/cli/answer_picture.h"
#include "query/cli/export/overlay.h"
#include "query/cli/export/top_view.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kRed = 0xff0000;

// Pixels that are nearly of one colour.
int CountOf(const picture::Picture& picture, uint32_t rgb) {
  int count = 0;
  for (size_t i = 0; i + 2 < picture.rgb.size(); i += 3) {
    const int distance = std::abs(picture.rgb[i] - static_cast<int>(rgb >> 16)) +
                         std::abs(picture.rgb[i + 1] - static_cast<int>((rgb >> 8) & 0xff)) +
                         std::abs(picture.rgb[i + 2] - static_cast<int>(rgb & 0xff));
    count += distance < 60;
  }
  return count;
}

picture::Picture Draw(const Overlay& overlay) {
  MapContent content = test::ExampleContent();
  content.mesh.clear();
  return DrawTopView(content, {.width_px = 800, .title = "t", .overlay = overlay});
}

TEST(Overlay, DrawsLinesMarksAndOutlines) {
  EXPECT_EQ(CountOf(Draw({}), kRed), 0);
  Overlay line;
  line.lines.push_back({.points_map = {{0.5, 0.5, 0.0}, {7.5, 3.5, 0.0}}, .rgb = kRed});
  EXPECT_GT(CountOf(Draw(line), kRed), 1000);
  for (const auto shape :
       {OverlayMark::Shape::kDot, OverlayMark::Shape::kRing, OverlayMark::Shape::kCross}) {
    Overlay mark;
    mark.marks.push_back({.position_map = {1.0, 1.0, 0.0}, .rgb = kRed, .shape = shape});
    EXPECT_GT(CountOf(Draw(mark), kRed), 20);
  }
  Overlay outline;
  outline.outlines.push_back({.corners_map = {{1, 1}, {2, 1}, {2, 2}, {1, 2}}, .rgb = kRed});
  EXPECT_GT(CountOf(Draw(outline), kRed), 100);
}

TEST(Overlay, OutlinesAndKeysHaveTheirOwnWidths) {
  Overlay thin;
  thin.outlines.push_back({.corners_map = {{1, 1}, {3, 1}, {3, 3}, {1, 3}},
                           .rgb = kRed,
                           .width_px = 2.0,
                           .opacity = 0.0f});
  Overlay thick = thin;
  thick.outlines[0].width_px = 12.0;
  EXPECT_GT(CountOf(Draw(thick), kRed), 2 * CountOf(Draw(thin), kRed));
  Overlay keyed;
  keyed.legend.push_back({"the way", kRed, 2.0});
  Overlay wide;
  wide.legend.push_back({"the way", kRed, 16.0});
  EXPECT_GT(CountOf(Draw(wide), kRed), 2 * CountOf(Draw(keyed), kRed));
}

// Half axes are standard deviations along the axes of the covariance.
TEST(Overlay, EllipsesAreOneStandardDeviation) {
  const Eigen::Vector2d middle(5.0, -2.0);
  const Eigen::Matrix2d covariance{{2.5, 1.5}, {1.5, 2.5}};
  double nearest = 1e9;
  double farthest = 0.0;
  for (const Eigen::Vector2d& corner : EllipseOf(middle, covariance)) {
    const Eigen::Vector2d off = corner - middle;
    EXPECT_NEAR(off.dot(covariance.inverse() * off), 1.0, 1e-9);
    nearest = std::min(nearest, off.norm());
    farthest = std::max(farthest, off.norm());
  }
  EXPECT_NEAR(nearest, 1.0, 1e-2);
  EXPECT_NEAR(farthest, 2.0, 1e-2);
  // Without any uncertainty, or with rounding below zero, it is a point.
  for (const Eigen::Vector2d& corner : EllipseOf(middle, -1e-12 * Eigen::Matrix2d::Identity())) {
    EXPECT_EQ(corner, middle);
  }
}

TEST(Overlay, GrowsThePictureToWhatLiesOutsideTheMap) {
  Overlay far;
  far.lines.push_back({.points_map = {{0.0, 0.0, 0.0}, {8.0, 40.0, 0.0}}, .rgb = kRed});
  EXPECT_GT(Draw(far).height, Draw({}).height);
  EXPECT_GT(CountOf(Draw(far), kRed), 1000);
}

TEST(Overlay, LegendHasARowOfItsOwn) {
  Overlay keyed;
  keyed.legend.push_back({"the way", kRed});
  EXPECT_EQ(Draw(keyed).height, Draw({}).height + 26);
  EXPECT_GT(CountOf(Draw(keyed), kRed), 30);
}

TEST(Overlay, LegendExplainsShapes) {
  Overlay line;
  line.legend.push_back({"enters", kRed});
  Overlay ring;
  ring.legend.push_back({.text = "enters", .rgb = kRed, .shape = OverlayMark::Shape::kRing});
  Overlay dot;
  dot.legend.push_back({.text = "leaves", .rgb = kRed, .shape = OverlayMark::Shape::kDot});
  EXPECT_EQ(OverlayLegend(ring).size(), 1u);
  EXPECT_LT(OverlayLegend(ring)[0].mark_px, OverlayLegend(line)[0].mark_px);
  EXPECT_GT(CountOf(Draw(ring), kRed), 5);
  EXPECT_GT(CountOf(Draw(dot), kRed), CountOf(Draw(ring), kRed));
}

// Better over a line than nowhere.
TEST(Overlay, LabelsMayCoverLines) {
  constexpr uint32_t kBlue = 0x0000ff;
  Overlay crowded;
  for (double y = 0.0; y <= 4.0; y += 0.1) {
    crowded.lines.push_back({.points_map = {{0.0, y, 0.0}, {8.0, y, 0.0}}, .rgb = kRed});
  }
  crowded.marks.push_back({.position_map = {4.0, 2.0, 0.0}, .rgb = kBlue});
  const int unnamed = CountOf(Draw(crowded), kBlue);
  crowded.marks[0].label = "MMMMMMMM";
  EXPECT_GT(CountOf(Draw(crowded), kBlue), unnamed + 5);
}

TEST(Overlay, OfOnePointAndOfNothingIsNoFault) {
  Overlay odd;
  odd.lines.push_back({.points_map = {{1.0, 1.0, 0.0}}, .rgb = kRed});
  odd.lines.push_back({.points_map = {}, .rgb = kRed});
  odd.outlines.push_back({.corners_map = {}, .rgb = kRed});
  EXPECT_GT(Draw(odd).width, 0);
}

}  // namespace
}  // namespace dsg::cli
