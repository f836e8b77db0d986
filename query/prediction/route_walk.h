// SPDX-License-Identifier: Apache-2.0
// Walks along a route, cutting corners where that is known to be free.
// Refuses to leave the route further than its clearances allow.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "query/prediction/pace.h"
#include "query/prediction/prediction.h"
#include "query/prediction/route.h"

namespace dsg::query {

/// Positions after `seconds` (ascending, from 0 on), setting out in the direction `heading_map`, a
/// unit vector.
/// Source: Coulter 1992 (pure pursuit).
std::vector<Eigen::Vector3d> WalkRoute(const Route& route, const Eigen::Vector3d& heading_map,
                                       const Pace& pace, const std::vector<double>& seconds,
                                       const GoalOptions& options);

}  // namespace dsg::query
