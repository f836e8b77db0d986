// SPDX-License-Identifier: Apache-2.0
// Which of many points is the nearest.
// Refuses to change once built.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace dsg::ingest {

/// Threads: safe from many threads.
class PointIndex {
 public:
  /// Requires: finite points.
  explicit PointIndex(std::vector<Eigen::Vector3f> points);
  ~PointIndex();
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;

  struct Hit {
    /// -1 when there are no points.
    int index = -1;
    float distance_m = 0.0f;
  };
  Hit Nearest(const Eigen::Vector3f& point) const;

 private:
  class Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace dsg::ingest
