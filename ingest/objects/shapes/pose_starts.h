// SPDX-License-Identifier: Apache-2.0
// Where a model might stand: starts all around, so that no true pose is far from one.
// Refuses to judge beyond a first look.
#pragma once

#include <optional>
#include <vector>

#include "ingest/objects/shapes/model_index.h"
#include "ingest/objects/shapes/shape_options.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

struct Start {
  Pose3d map_T_model;
  double cost = 1.0;
};

/// Turns all around; at each the model's box against the points' box: flush with either side or
/// in the middle on x and y, flush below or above on z (on the floor when its height is known).
/// The `count` best that differ, best first.
std::vector<Start> FindStarts(const ModelIndex& model,
                              const std::vector<Eigen::Vector3d>& points_map,
                              std::optional<double> floor_z_map, size_t count,
                              const StartOptions& options);

/// The first of each group of poses within `same_m` and `same_deg`; `starts` ascending by cost.
std::vector<Start> KeepDistinct(const std::vector<Start>& starts, size_t count,
                                const StartOptions& options);

}  // namespace dsg::ingest
