// SPDX-License-Identifier: Apache-2.0
// Which loop closures to believe, and the poses that agree with those.
// Refuses to doubt odometry.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/pose_graph.h"
#include "ingest/loop/robust_options.h"

namespace dsg::ingest {

struct RobustResult {
  Optimized optimized;
  /// For each edge: true for odometry and the loops that were believed.
  std::vector<bool> is_kept;
  int64_t loop_count = 0;
  int64_t kept_count = 0;
  int64_t rejected_by_consistency_count = 0;
  int64_t rejected_by_graduation_count = 0;
};

/// Pairwise consistency maximisation, then graduated non-convexity with truncated least squares.
/// Loops are believed when others bear them out so precisely that wrong ones would not; from these
/// belief spreads to loops that fit where wrong ones would not, the noise taken as it is seen in
/// the loops believed so far, not as the information matrices say. Graduation decides on the rest
/// together. What is kept agrees with the last solution. With no loop contradicted, every loop is
/// kept.
///
/// Errors: of Optimize. Deterministic.
/// Source: Mangelson et al. 2018 (PCM); Yang et al. 2020 (GNC-TLS).
absl::StatusOr<RobustResult> OptimizeRobustly(const PoseGraph& graph, const RobustOptions& options);

/// Whether each edge is in the largest set of loops that agree in pairs, and with odometry.
std::vector<bool> ConsistentLoops(const PoseGraph& graph, double confidence);

}  // namespace dsg::ingest
