// SPDX-License-Identifier: Apache-2.0
// Which labels of a picture fit: spots are given once.
// Refuses spots that touch an earlier one or leave the picture.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace dsg::picture {

/// Cost: a spot is compared with its neighbourhood, whatever the number of labels.
class LabelLayout {
 public:
  /// `area`: where labels may be, pixels.
  explicit LabelLayout(const Eigen::AlignedBox2d& area);

  bool IsFree(const Eigen::AlignedBox2d& spot) const;
  /// Takes the spot whatever is there.
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
