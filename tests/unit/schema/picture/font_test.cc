// SPDX-License-Identifier: Apache-2.0
// Every text has letters, and no byte leads the reader astray.
#include "schema/picture/font.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "schema/base/random.h"

namespace dsg::picture {
namespace {

constexpr double kCapPx = 14.0;

std::shared_ptr<const Letter> LetterOf(std::string_view text) {
  const auto letters = LettersOf(text, kCapPx);
  EXPECT_EQ(letters.size(), 1u) << text;
  return letters.at(0);
}

TEST(Font, DrawsEachVisibleCharacterDifferently) {
  std::set<std::pair<std::vector<uint8_t>, int>> seen;
  for (char c = 0x21; c <= 0x7e; ++c) {
    const auto letter = LetterOf(std::string(1, c));
    EXPECT_TRUE(seen.insert({letter->coverage, letter->top_px}).second)
        << "'" << c << "' looks like another";
  }
}

TEST(Font, HasTheSizeThatWasAskedFor) {
  for (const double cap_px : {7.0, 14.0, 40.0}) {
    const auto letter = LettersOf("H", cap_px).at(0);
    EXPECT_NEAR(letter->height, cap_px, 1.0);
    EXPECT_EQ(letter->top_px, letter->height);
  }
  // What hangs below the line.
  for (char c = 0x21; c <= 0x7e; ++c) {
    const auto letter = LetterOf(std::string(1, c));
    EXPECT_LE(letter->height - letter->top_px, kDescentDots * kCapPx / kCapHeightDots) << c;
  }
}

TEST(Font, CountsCharactersAndNotBytes) {
  EXPECT_EQ(LettersOf("Küche", kCapPx).size(), 5u);
  EXPECT_NE(LetterOf("ü")->coverage, LetterOf("u")->coverage);
  EXPECT_NE(LetterOf("Ł")->coverage, LetterOf("L")->coverage);
  // No letter for these: a box each.
  EXPECT_EQ(LettersOf("厨房", kCapPx).size(), 2u);
  EXPECT_EQ(LetterOf("厨")->coverage, LetterOf("房")->coverage);
  EXPECT_FALSE(LetterOf("厨")->coverage.empty());
  EXPECT_TRUE(LettersOf("", kCapPx).empty());
}

TEST(Font, DrawsABoxForBytesThatAreNoText) {
  // A character that breaks off, and a letter after it.
  const auto letters = LettersOf(
      "\xe5\x8e"
      "a",
      kCapPx);
  ASSERT_EQ(letters.size(), 2u);
  EXPECT_EQ(letters[0], LetterOf("\xff"));
  EXPECT_EQ(letters[1], LetterOf("a"));
  Random random(1, 0);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(static_cast<size_t>(i % 9), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random.Integer(0, 255));
    EXPECT_LE(LettersOf(bytes, kCapPx).size(), bytes.size());
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
