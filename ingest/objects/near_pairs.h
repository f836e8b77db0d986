// SPDX-License-Identifier: Apache-2.0
// Which of many boxes are near to each other.
// Refuses to compare all with all.
#pragma once

#include <utility>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Distance between two boxes, 0 when they meet.
double DistanceBetween(const Box3d& a, const Box3d& b);

/// Pairs (i, j), i < j, with at most `distance_m` between the boxes; ascending.
/// Requires: no box is empty.
std::vector<std::pair<int, int>> NearPairs(const std::vector<Box3d>& boxes, double distance_m);

}  // namespace dsg::ingest
