// SPDX-License-Identifier: Apache-2.0
// Every text has letters, and no byte leads the reader astray.
#include "schema/picture/font.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "schema/base/random.h"

namespace dsg::picture {
namespace {

TEST(Font, DrawsEachVisibleCharacterDifferently) {
  std::set<std::array<uint8_t, kGlyphHeightDots>> seen;
  for (char c = 0x21; c <= 0x7e; ++c) {
    const auto glyphs = GlyphsOf(std::string(1, c));
    ASSERT_EQ(glyphs.size(), 1u);
    EXPECT_TRUE(seen.insert(glyphs[0]->rows).second) << "'" << c << "' looks like another";
  }
}

TEST(Font, KeepsItsDotsInFiveColumns) {
  for (char c = 0x20; c <= 0x7e; ++c) {
    for (const uint8_t row : GlyphsOf(std::string(1, c))[0]->rows) EXPECT_LT(row, 1 << 5) << c;
  }
}

TEST(Font, CountsCharactersAndNotBytes) {
  EXPECT_EQ(GlyphsOf("Küche").size(), 5u);
  EXPECT_EQ(GlyphsOf("Küche"), GlyphsOf("Kuche"));
  EXPECT_EQ(GlyphsOf("Łódź"), GlyphsOf("Lodz"));
  // No letter for these: a box each.
  EXPECT_EQ(GlyphsOf("厨房").size(), 2u);
  EXPECT_EQ(GlyphsOf("厨房")[0], GlyphsOf("🚪")[0]);
  EXPECT_TRUE(GlyphsOf("").empty());
}

TEST(Font, DrawsABoxForBytesThatAreNoText) {
  const Glyph* const box = GlyphsOf("\n")[0];
  EXPECT_EQ(GlyphsOf("\xff"), std::vector<const Glyph*>({box}));
  // A character that breaks off, and a letter after it.
  EXPECT_EQ(GlyphsOf("\xe5\x8e"
                     "a"),
            std::vector<const Glyph*>({box, GlyphsOf("a")[0]}));
  Random random(1, 0);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(static_cast<size_t>(i % 9), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random.Integer(0, 255));
    EXPECT_LE(GlyphsOf(bytes).size(), bytes.size());
  }
}

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
