// SPDX-License-Identifier: Apache-2.0
// A model's pose made better from a start nearby, and how well a pose explains the points.
// Refuses to search: a start in the wrong valley ends in the wrong valley.
#pragma once

#include <vector>

#include "ingest/objects/shapes/model_index.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

struct AlignmentOptions {
  /// Yaw and position only.
  bool is_upright = true;
  /// Nearest points by search instead of by table.
  bool is_exact = false;
  int iteration_count_max = 10;
  /// Points farther from the model do not count: at the first and at the last iteration.
  double gate_first_m = 0.3;
  double gate_last_m = 0.12;
  /// Of the distance to a point, against the distance to its plane.
  double point_weight = 0.1;
};

/// Trimmed iterative closest points, to planes and a little to points.
Pose3d Align(const ModelIndex& model, const std::vector<Eigen::Vector3d>& points_map,
             const Pose3d& map_T_model, const AlignmentOptions& options);

/// What a pose explains.
struct Explanation {
  /// Mean of min(d^2 / bound^2, 1) over the points; 0 = all on the model, 1 = all off it.
  double cost = 1.0;
  /// Share of points within the bound, and their root mean square distance.
  double inlier_share = 0.0;
  double residual_m = 0.0;
  /// Share of the model's patches with a point nearby.
  double covered_share = 0.0;
};

Explanation Explain(const ModelIndex& model, const std::vector<Eigen::Vector3d>& points_map,
                    const Pose3d& map_T_model, double bound_m, bool is_exact);

}  // namespace dsg::ingest
