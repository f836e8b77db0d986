// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/point_index.h"

#include <cmath>
#include <nanoflann.hpp>
#include <utility>

namespace dsg::ingest {

class PointIndex::Tree {
 public:
  explicit Tree(std::vector<Eigen::Vector3f> points)
      : set_{std::move(points)}, tree_(3, set_, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
    if (!set_.points.empty()) tree_.buildIndex();
  }

  Hit Nearest(const Eigen::Vector3f& point) const {
    if (set_.points.empty()) return {};
    size_t index = 0;
    float squared = 0.0f;
    if (tree_.knnSearch(point.data(), 1, &index, &squared) == 0) return {};
    return {static_cast<int>(index), std::sqrt(squared)};
  }

 private:
  /// What nanoflann asks of a set of points; the names are its own.
  struct PointSet {
    std::vector<Eigen::Vector3f> points;

    size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(size_t index, size_t axis) const {
      return points[index][static_cast<Eigen::Index>(axis)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };

  using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointSet>,
                                                     PointSet, 3, size_t>;

  PointSet set_;
  KdTree tree_;
};

PointIndex::PointIndex(std::vector<Eigen::Vector3f> points)
    : tree_(std::make_unique<Tree>(std::move(points))) {}
PointIndex::~PointIndex() = default;
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;

PointIndex::Hit PointIndex::Nearest(const Eigen::Vector3f& point) const {
  return tree_->Nearest(point);
}

}  // namespace dsg::ingest
