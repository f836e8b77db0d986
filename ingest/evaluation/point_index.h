// SPDX-License-Identifier: Apache-2.0
// Nearest neighbours among fixed points.
// Refuses points that come later.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace dsg::evaluation {

struct Neighbour {
  size_t index = 0;
  double distance_m = 0.0;
};

/// A k-d tree.
///
/// Threads: safe from many threads once built.
class PointIndex {
 public:
  explicit PointIndex(std::vector<Eigen::Vector3f> points);
  ~PointIndex();
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;

  /// Up to `count` points, nearest first.
  std::vector<Neighbour> Nearest(const Eigen::Vector3d& point, size_t count) const;
  const std::vector<Eigen::Vector3f>& points() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace dsg::evaluation
