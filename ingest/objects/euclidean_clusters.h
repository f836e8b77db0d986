// SPDX-License-Identifier: Apache-2.0
// Points that hang together in steps of at most a given length.
// Refuses to look at anything but positions.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dsg::ingest {

/// Indices of `points`, ascending within a cluster; clusters ascending by their first index.
/// Every point is in one. Requires: finite points, tolerance_m > 0.
/// Source: Rusu, 2009 (Euclidean cluster extraction), as PCL does it.
std::vector<std::vector<int>> EuclideanClusters(const std::vector<Eigen::Vector3f>& points,
                                                double tolerance_m);

}  // namespace dsg::ingest
