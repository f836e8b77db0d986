// SPDX-License-Identifier: Apache-2.0
// The place nearest to a point, for poses that say where they were and not in which place.
// Refuses to look further than a few metres: beyond, a place says nothing about a pose.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "schema/model/node.h"

namespace dsg {

/// Cost: a search in the order of x; fine for some ten thousand places.
class PlaceFinder {
 public:
  explicit PlaceFinder(const std::vector<Node>& nodes);

  /// The empty id if there is none within reach; of several equally near the lowest.
  NodeId Nearest(const Eigen::Vector3d& point_map) const;

 private:
  std::vector<std::pair<Eigen::Vector3d, NodeId>> places_;
};

}  // namespace dsg
