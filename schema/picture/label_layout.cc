// SPDX-License-Identifier: Apache-2.0
#include "schema/picture/label_layout.h"

#include <algorithm>
#include <cmath>

namespace dsg::picture {
namespace {

constexpr double kCellPx = 64.0;

int CellCount(double length_px) {
  return std::max(1, static_cast<int>(std::ceil(length_px / kCellPx)));
}

int CellOf(double offset_px, int count) {
  return static_cast<int>(std::clamp(std::floor(offset_px / kCellPx), 0.0, count - 1.0));
}

bool Overlap(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
  return (a.min().array() < b.max().array()).all() && (b.min().array() < a.max().array()).all();
}

}  // namespace

LabelLayout::LabelLayout(const Eigen::AlignedBox2d& area)
    : area_(area),
      column_count_(CellCount(area.sizes().x())),
      row_count_(CellCount(area.sizes().y())),
      cells_(static_cast<size_t>(column_count_) * static_cast<size_t>(row_count_)) {}

template <class Visit>
void LabelLayout::VisitCells(const Eigen::AlignedBox2d& spot, const Visit& visit) const {
  const Eigen::Vector2d low = spot.min() - area_.min();
  const Eigen::Vector2d high = spot.max() - area_.min();
  for (int y = CellOf(low.y(), row_count_); y <= CellOf(high.y(), row_count_); ++y) {
    for (int x = CellOf(low.x(), column_count_); x <= CellOf(high.x(), column_count_); ++x) {
      visit(static_cast<size_t>(y) * static_cast<size_t>(column_count_) + static_cast<size_t>(x));
    }
  }
}

bool LabelLayout::IsFree(const Eigen::AlignedBox2d& spot) const {
  if (!area_.contains(spot)) return false;
  bool is_free = true;
  VisitCells(spot, [&](size_t cell) {
    is_free = is_free && std::none_of(cells_[cell].begin(), cells_[cell].end(),
                                      [&](size_t other) { return Overlap(spots_[other], spot); });
  });
  return is_free;
}

void LabelLayout::Block(const Eigen::AlignedBox2d& spot) {
  VisitCells(spot, [&](size_t cell) { cells_[cell].push_back(spots_.size()); });
  spots_.push_back(spot);
}

}  // namespace dsg::picture
