// SPDX-License-Identifier: Apache-2.0
// Truncated least squares over the loops of a graph, reached by hardening a soft cost in steps.
// Refuses to doubt odometry, and to find loops that it was told to leave out.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

struct GraduationOptions {
  OptimizeOptions optimize;
  /// Squared residual from which on a loop costs no more.
  double gate = 16.81;
  /// mu grows by this factor a step.
  double factor = 1.4;
  int step_count_max = 100;
};

struct Graduation {
  std::vector<Pose3d> poses;
  /// By edge; 1 for odometry, 0 for what was left out, 0 ... 1 for loops.
  std::vector<double> weights;
  int step_count = 0;
  /// Whether all weights came to be 0 or 1.
  bool is_converged = false;
};

/// Begins at `map_T_pose`. Loops that are no candidates take no part.
///
/// Errors: of Optimize. Deterministic.
/// Source: Yang et al. 2020 (GNC-TLS).
absl::StatusOr<Graduation> Graduate(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                                    const std::vector<bool>& is_candidate,
                                    const GraduationOptions& options);

}  // namespace dsg::ingest
