// SPDX-License-Identifier: Apache-2.0
// Letters of 5 x 7 dots for pictures: ASCII, and Latin letters without their accents.
// Refuses no text: what it has no letter for is a small box.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace dsg::picture {

inline constexpr int kGlyphWidthDots = 5;
inline constexpr int kGlyphHeightDots = 7;
/// From the left of one letter to the left of the next.
inline constexpr int kAdvanceDots = 6;
/// How far g, p, q, y and the like reach below the line.
inline constexpr int kDescentDots = 2;

struct Glyph {
  /// From the top, five dots each, the leftmost in bit 4.
  std::array<uint8_t, kGlyphHeightDots> rows{};
  /// Dots that the whole letter is shifted down.
  int drop = 0;
};

/// One glyph a character. Bytes that are no UTF-8 are a box each.
std::vector<const Glyph*> GlyphsOf(std::string_view text);

}  // namespace dsg::picture
