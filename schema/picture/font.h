// SPDX-License-Identifier: Apache-2.0
// Text in pictures: the letters of DejaVu Sans, and free spots for labels.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace dsg::picture {

/// The height of capitals and figures, in the dots that sizes of texts are told in.
inline constexpr int kCapHeightDots = 7;
/// How far g, p, q, y and the like reach below the line, at most.
inline constexpr int kDescentDots = 3;

/// One letter, drawn at a size.
struct Letter {
  /// From where it begins to where the next one does.
  double advance_px = 0.0;
  /// Of its pixels: from where it begins to their left, and from the line up to their top.
  int left_px = 0;
  int top_px = 0;
  int width = 0;
  int height = 0;
  /// Row by row from the top: how much of each pixel the letter covers, of 255.
  std::vector<uint8_t> coverage;
};

/// One letter a character; a box for what the font lacks, and for bytes that are not UTF-8.
///
/// Threads: safe from many threads.
std::vector<std::shared_ptr<const Letter>> LettersOf(std::string_view text, double cap_height_px);

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
