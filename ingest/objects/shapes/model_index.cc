// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/model_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>

namespace dsg::ingest {
namespace {

// No options: how fast a nearest point is found, and how far around a model at least.
constexpr size_t kLeafPoints = 16;
constexpr double kTableMarginM = 0.4;
constexpr double kTableCellM = 0.04;
constexpr double kTableCellCountMax = 200'000.0;

}  // namespace

struct ModelIndex::Tree {
  struct Points {
    const std::vector<Eigen::Vector3d>& points;
    // The names are nanoflann's.
    size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(size_t index, size_t axis) const {
      return points[index][static_cast<Eigen::Index>(axis)];
    }
    template <typename Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };

  using Metric = nanoflann::L2_Simple_Adaptor<double, Points, double, uint32_t>;
  using KdTree = nanoflann::KDTreeSingleIndexAdaptor<Metric, Points, 3, uint32_t>;

  explicit Tree(std::vector<Eigen::Vector3d> in)
      : own(std::move(in)), points{own}, tree(3, points, {kLeafPoints}) {}
  std::vector<Eigen::Vector3d> own;
  Points points;
  KdTree tree;
};

ModelIndex::ModelIndex(Surface surface, double patch_m)
    : surface_(std::move(surface)), tree_(std::make_unique<Tree>(surface_.points)) {
  for (const Eigen::Vector3d& point : surface_.points) box_.extend(point);
  FillTable();
  FillPatches(patch_m);
}
ModelIndex::~ModelIndex() = default;
ModelIndex::ModelIndex(ModelIndex&&) noexcept = default;
ModelIndex& ModelIndex::operator=(ModelIndex&&) noexcept = default;

void ModelIndex::FillTable() {
  const Eigen::Vector3d sizes = box_.sizes() + Eigen::Vector3d::Constant(2.0 * kTableMarginM);
  cell_m_ = std::max(kTableCellM, std::cbrt(sizes.prod() / kTableCellCountMax));
  table_min_ = box_.min() - Eigen::Vector3d::Constant(kTableMarginM);
  for (int axis = 0; axis < 3; ++axis) {
    table_size_[static_cast<size_t>(axis)] =
        static_cast<int64_t>(std::floor(sizes[axis] / cell_m_)) + 1;
  }
  table_.reserve(static_cast<size_t>(table_size_[0] * table_size_[1] * table_size_[2]));
  for (int64_t z = 0; z < table_size_[2]; ++z) {
    for (int64_t y = 0; y < table_size_[1]; ++y) {
      for (int64_t x = 0; x < table_size_[0]; ++x) {
        const Eigen::Vector3d cell(static_cast<double>(x), static_cast<double>(y),
                                   static_cast<double>(z));
        table_.push_back(Nearest(table_min_ + (cell + Eigen::Vector3d::Constant(0.5)) * cell_m_));
      }
    }
  }
}

void ModelIndex::FillPatches(double patch_m) {
  std::vector<std::pair<std::array<int64_t, 3>, size_t>> order;
  for (size_t i = 0; i < surface_.points.size(); ++i) {
    const Eigen::Vector3d cell = (surface_.points[i] / patch_m).array().floor();
    order.push_back({{static_cast<int64_t>(cell.x()), static_cast<int64_t>(cell.y()),
                      static_cast<int64_t>(cell.z())},
                     i});
  }
  std::sort(order.begin(), order.end());
  patches_.resize(order.size());
  for (size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && order[i].first != order[i - 1].first) ++patch_count_;
    patches_[order[i].second] = patch_count_;
  }
  ++patch_count_;
}

int ModelIndex::Nearest(const Eigen::Vector3d& point_model) const {
  uint32_t index = 0;
  double squared = 0.0;
  tree_->tree.knnSearch(point_model.data(), 1, &index, &squared);
  return static_cast<int>(index);
}

int ModelIndex::NearestQuickly(const Eigen::Vector3d& point_model) const {
  const Eigen::Vector3d at = (point_model - table_min_) / cell_m_;
  size_t index = 0;
  for (size_t axis = 3; axis-- > 0;) {
    const double value = at[static_cast<Eigen::Index>(axis)];
    if (!(value >= 0.0 && value < static_cast<double>(table_size_[axis]))) return -1;
    index = index * static_cast<size_t>(table_size_[axis]) + static_cast<size_t>(value);
  }
  return table_[index];
}

}  // namespace dsg::ingest
