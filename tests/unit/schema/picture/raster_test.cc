// SPDX-License-Identifier: Apache-2.0
// Pictures hold what was drawn, and their PNG has the frame that the format asks for.
#include "schema/picture/raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace dsg::picture {
namespace {

using Pixel = std::array<int, 3>;
using Vector = Eigen::Vector2d;

Pixel At(const Picture& picture, int x, int y) {
  const size_t i = 3 * static_cast<size_t>(y * picture.width + x);
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

TEST(Canvas, FillsRectanglesAndBlends) {
  Canvas canvas(40, 20, MakePaint(0xffffff));
  canvas.FillRect(Vector(0, 0), Vector(20, 20), MakePaint(0xff0000));
  canvas.FillRect(Vector(10, 0), Vector(20, 20), MakePaint(0x0000ff, 0.5f));
  const Picture picture = canvas.Halved();
  EXPECT_EQ(picture.width, 20);
  EXPECT_EQ(picture.height, 10);
  EXPECT_EQ(At(picture, 2, 5), (Pixel{255, 0, 0}));
  EXPECT_EQ(At(picture, 7, 5), (Pixel{128, 0, 128}));
  EXPECT_EQ(At(picture, 15, 5), (Pixel{255, 255, 255}));
}

TEST(Canvas, OfAPictureGivesItBack) {
  Picture picture{3, 2, {}};
  for (uint8_t i = 0; i < 18; ++i) picture.rgb.push_back(static_cast<uint8_t>(13 * i));
  Canvas canvas(picture);
  EXPECT_EQ(canvas.width(), 6);
  EXPECT_EQ(canvas.height(), 4);
  EXPECT_EQ(canvas.Halved().rgb, picture.rgb);
  canvas.FillRect(Vector(2, 0), Vector(4, 2), MakePaint(0x0000ff));
  picture.rgb[3] = picture.rgb[4] = 0;
  picture.rgb[5] = 255;
  EXPECT_EQ(canvas.Halved().rgb, picture.rgb);
}

TEST(Canvas, CutsShapesAtItsBorder) {
  Canvas canvas(20, 20, MakePaint(0xffffff));
  canvas.FillRect(Vector(-50, -50), Vector(4, 4), MakePaint(0x000000));
  canvas.FillCircle(Vector(400, 10), 5.0, MakePaint(0x000000));
  canvas.DrawPolyline({Vector(-100, 15), Vector(100, 15)}, 2.0, MakePaint(0x00ff00));
  canvas.DrawText(Vector(15, 15), "off the edge", 3.0, MakePaint(0xff0000));
  const Picture picture = canvas.Halved();
  EXPECT_EQ(At(picture, 0, 0), (Pixel{0, 0, 0}));
  EXPECT_EQ(At(picture, 5, 5), (Pixel{255, 255, 255}));
  EXPECT_EQ(At(picture, 3, 7), (Pixel{0, 255, 0}));
}

TEST(Canvas, FillsPolygonsWithNotchesByTheEvenOddRule) {
  Canvas canvas(40, 40, MakePaint(0xffffff));
  // A U that opens to the top, partly above the border.
  canvas.FillPolygon({Vector(4, -9), Vector(12, -9), Vector(12, 28), Vector(28, 28), Vector(28, 4),
                      Vector(36, 4), Vector(36, 36), Vector(4, 36)},
                     MakePaint(0x0000ff));
  const Picture picture = canvas.Halved();
  EXPECT_EQ(At(picture, 4, 0), (Pixel{0, 0, 255}));
  EXPECT_EQ(At(picture, 10, 10), (Pixel{255, 255, 255}));
  EXPECT_EQ(At(picture, 10, 16), (Pixel{0, 0, 255}));
  EXPECT_EQ(At(picture, 16, 0), (Pixel{255, 255, 255}));
  EXPECT_EQ(At(picture, 19, 19), (Pixel{255, 255, 255}));
}

TEST(Canvas, FillsPolygonsThatShareAnEdgeWithoutGapOrOverlap) {
  Canvas canvas(40, 40, MakePaint(0xffffff));
  const Vector middle(17.3, 21.9);
  const std::array<Vector, 4> corners = {Vector(0, 0), Vector(40, 0), Vector(40, 40),
                                         Vector(0, 40)};
  for (size_t i = 0; i < 4; ++i) {
    canvas.FillPolygon({corners[i], corners[(i + 1) % 4], middle}, MakePaint(0x000000, 0.5f));
  }
  const Picture picture = canvas.Halved();
  EXPECT_TRUE(std::all_of(picture.rgb.begin(), picture.rgb.end(),
                          [](uint8_t channel) { return channel == 128; }));
}

TEST(Canvas, DrawsNothingOfPolygonsWithoutAreaOrFarAway) {
  Canvas canvas(20, 20, MakePaint(0xffffff));
  canvas.FillPolygon({Vector(1, 1), Vector(9, 9)}, MakePaint(0x000000));
  canvas.FillPolygon({}, MakePaint(0x000000));
  canvas.DrawOutline({}, 2.0, MakePaint(0x000000));
  canvas.FillPolygon({Vector(1e30, 1e30), Vector(2e30, 1e30), Vector(1e30, 2e30)},
                     MakePaint(0x000000));
  const Picture picture = canvas.Halved();
  EXPECT_TRUE(std::all_of(picture.rgb.begin(), picture.rgb.end(),
                          [](uint8_t channel) { return channel == 255; }));
}

TEST(Canvas, DoesNotDarkenAStrokeWhereItCrossesItself) {
  Canvas canvas(40, 40, MakePaint(0xffffff));
  canvas.DrawPolyline({Vector(0, 20), Vector(40, 20), Vector(40, 0), Vector(20, 0), Vector(20, 40)},
                      6.0, MakePaint(0x000000, 0.5f));
  const Picture picture = canvas.Halved();
  EXPECT_EQ(At(picture, 10, 10), At(picture, 4, 10));
  EXPECT_EQ(At(picture, 10, 10), (Pixel{128, 128, 128}));
}

TEST(Canvas, DrawsLettersAsWideAsItSays) {
  Canvas canvas(120, 60, MakePaint(0xffffff));
  canvas.DrawText(Vector(0, 0), "Hgm", 4.0, MakePaint(0x000000));
  const double width = Canvas::TextWidth("Hgm", 4.0);
  EXPECT_GT(width, Canvas::TextWidth("Hgi", 4.0));
  EXPECT_NEAR(2 * width, Canvas::TextWidth("Hgm", 8.0), 0.1);
  const Picture picture = canvas.Halved();
  int right = 0;
  int bottom = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (At(picture, x, y)[0] > 200) continue;
      right = std::max(right, x);
      bottom = std::max(bottom, y);
    }
  }
  // Space to the next letter belongs to the width.
  EXPECT_NEAR(right, width / 2, 3.0);
  // Seven dots of two pixels, and what the g hangs below them.
  EXPECT_GT(bottom, 14);
  EXPECT_LE(bottom, 14 + 2 * kDescentDots);
}

TEST(EncodePng, WritesSignatureSizeAndEnd) {
  Canvas canvas(600, 400, MakePaint(0x336699));
  const auto bytes = EncodePng(canvas.Halved());
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  // Portable Network Graphics, second edition: sections 5.2, 11.2.2 and 11.2.5.
  EXPECT_EQ(bytes->substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes->substr(12, 4), "IHDR");
  EXPECT_EQ(bytes->substr(16, 8), std::string("\0\0\x01\x2c\0\0\0\xc8", 8));
  EXPECT_EQ(bytes->substr(bytes->size() - 8, 4), "IEND");
}

}  // namespace
}  // namespace dsg::picture
