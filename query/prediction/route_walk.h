// SPDX-License-Identifier: Apache-2.0
// Walks along a route at a steady pace, cutting corners where that is known to be free.
// Refuses to leave the route further than its clearances allow.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "query/prediction/prediction.h"
#include "query/prediction/route.h"

namespace dsg::query {

/// Positions after `seconds` (ascending, from 0 on), starting with `velocity_map`.
/// Source: Coulter 1992 (pure pursuit).
std::vector<Eigen::Vector3d> WalkRoute(const Route& route, const Eigen::Vector3d& velocity_map,
                                       const std::vector<double>& seconds,
                                       const GoalOptions& options);

}  // namespace dsg::query
