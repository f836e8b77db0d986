// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/point_index.h"

#include <array>
#include <cmath>
#include <nanoflann.hpp>

namespace dsg::evaluation {
namespace {

constexpr size_t kLeafPoints = 16;

}  // namespace

struct PointIndex::Tree {
  struct Points {
    std::vector<Eigen::Vector3f> points;
    // The names are nanoflann's.
    size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(size_t index, size_t axis) const {
      return points[index][static_cast<Eigen::Index>(axis)];
    }
    template <typename Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };

  using Metric = nanoflann::L2_Simple_Adaptor<float, Points, double, uint32_t>;
  using KdTree = nanoflann::KDTreeSingleIndexAdaptor<Metric, Points, 3, uint32_t>;

  explicit Tree(std::vector<Eigen::Vector3f> in)
      : points{std::move(in)}, tree(3, points, {kLeafPoints}) {}
  Points points;
  KdTree tree;
};

PointIndex::PointIndex(std::vector<Eigen::Vector3f> points)
    : tree_(std::make_unique<Tree>(std::move(points))) {}
PointIndex::~PointIndex() = default;
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;

const std::vector<Eigen::Vector3f>& PointIndex::points() const { return tree_->points.points; }

std::vector<Neighbour> PointIndex::Nearest(const Eigen::Vector3d& point, size_t count) const {
  if (tree_->points.points.empty() || count == 0) return {};
  std::vector<uint32_t> indices(count);
  std::vector<double> squared(count);
  const Eigen::Vector3f query = point.cast<float>();
  const size_t found = tree_->tree.knnSearch(query.data(), count, indices.data(), squared.data());
  std::vector<Neighbour> out(found);
  for (size_t i = 0; i < found; ++i) out[i] = {indices[i], std::sqrt(squared[i])};
  return out;
}

}  // namespace dsg::evaluation
