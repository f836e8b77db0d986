// SPDX-License-Identifier: Apache-2.0
// Text in pictures: glyphs of 5 x 7 dots, and free spots for labels. ASCII and Latin letters
// without accents; any other character is a small box.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace dsg::picture {

inline constexpr int kGlyphWidthDots = 5;
inline constexpr int kGlyphHeightDots = 7;
/// Distance between the left edges of neighbouring letters.
inline constexpr int kAdvanceDots = 6;
/// How far g, p, q, y and the like reach below the line.
inline constexpr int kDescentDots = 2;

struct Glyph {
  /// From the top, five dots each, the leftmost in bit 4.
  std::array<uint8_t, kGlyphHeightDots> rows{};
  /// Dots that the whole letter is shifted down.
  int drop = 0;
};

/// One glyph per character. Bytes that are not UTF-8 are a box each.
std::vector<const Glyph*> GlyphsOf(std::string_view text);

/// Assigns spots for labels, each once: a spot must not touch an earlier one or leave the picture.
/// Cost: a spot is compared with its neighbourhood only.
class LabelLayout {
 public:
  /// `area`: where labels may stand, pixels.
  explicit LabelLayout(const Eigen::AlignedBox2d& area);

  bool IsFree(const Eigen::AlignedBox2d& spot) const;
  /// Blocks the spot, whether it is free or not.
  void Block(const Eigen::AlignedBox2d& spot);

 private:
  template <class Visit>
  void VisitCells(const Eigen::AlignedBox2d& spot, const Visit& visit) const;

  Eigen::AlignedBox2d area_;
  int column_count_;
  int row_count_;
  /// Indices into spots_, by cell.
  std::vector<std::vector<size_t>> cells_;
  std::vector<Eigen::AlignedBox2d> spots_;
};

}  // namespace dsg::picture
