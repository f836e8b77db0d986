// SPDX-License-Identifier: Apache-2.0
// The poses that agree best with all that was measured between them.
// Refuses to doubt a measurement: robust.h does.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

enum class PoseObjective {
  /// Squared residuals of RelativePose under their whole information matrices.
  kGeodesic,
  /// kappa |R_j - R_i R_z|_F^2 + tau |t_j - t_i - R_i t_z|^2, one kappa and tau an edge.
  /// Source: Rosen et al. 2019 (SE-Sync), whose certified optima it shares.
  kSeSync,
  /// As kGeodesic, with the vector part of the quaternion in place of the rotation vector, which is
  /// half as long: g2o's chi^2. Planar graphs: the same as kGeodesic.
  kQuaternion,
};

/// Covariances of a larger graph with many loops may not fit into memory.
inline constexpr size_t kCovariancePosesMax = 20'000;

struct OptimizeOptions {
  PoseObjective objective = PoseObjective::kGeodesic;
  int iteration_count_max = 100;
  /// Relative decrease of the cost at which it is done: numerical, no option of dsg-ingest.
  double tolerance = 1e-10;
  /// Start from rotations and translations found linearly (chordal), instead of from the graph's
  /// poses. Source: Martinec and Pajdla 2007; Carlone et al. 2015.
  bool is_chordal_start = true;
  /// A weight for each edge, or empty = 1; edges of weight 0 take no part.
  std::vector<double> weights;
  /// Pose that stays where it is; each part that hangs apart keeps its first pose.
  int fixed_pose = 0;
  /// Also compute the 6x6 covariance of each pose against the fixed one (costly).
  bool has_covariance = false;
  /// After each iteration: cost so far. May be empty.
  std::function<void(int iteration, double cost)> on_iteration;
};

struct Optimized {
  std::vector<Pose3d> poses;
  /// Half the sum of squared whitened residuals of the objective, at the start and at the end.
  double start_cost = 0.0;
  double cost = 0.0;
  int iteration_count = 0;
  bool is_converged = false;
  /// By pose, translation (map axes) before rotation (right perturbation), against the fixed pose
  /// or the first one of its part, which have zeros; planar graphs: rows 0, 1 and 5. Empty unless
  /// asked for.
  std::vector<Matrix6d> covariances;
};

/// Errors: INVALID_ARGUMENT/FIELD_INVALID for weights of another count, indices outside the graph,
/// an edge from a pose to itself, information that is not positive definite, numbers that are not
/// finite or too large to be squared; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for covariances of more
/// than kCovariancePosesMax poses. Deterministic: one thread, no BLAS. Threads: safe.
absl::StatusOr<Optimized> Optimize(const PoseGraph& graph, const OptimizeOptions& options);

/// Half the sum of squared whitened residuals of `poses`. kSeSync: half of SE-Sync's F.
double CostOf(const PoseGraph& graph, const std::vector<Pose3d>& poses,
              const std::vector<double>& weights, PoseObjective objective);
/// Squared residual of one edge under its whole information (chi^2 of 6 or 3 degrees of freedom).
double SquaredResidual(const RelativePose& edge, bool is_planar, const Pose3d& map_T_from,
                       const Pose3d& map_T_to);
/// SE-Sync's weights of an edge.
struct SeSyncWeights {
  double kappa = 0.0;
  double tau = 0.0;
};
SeSyncWeights WeightsOf(const RelativePose& edge, bool is_planar);

/// Rotations first, then translations, each by one sparse linear solve. The first pose of each part
/// stays; where the equations are singular, edges are followed one by one instead.
std::vector<Pose3d> ChordalStart(const PoseGraph& graph, const std::vector<double>& weights);

/// For each pose the part of the graph that it hangs in, numbered from 0 by first pose; edges of
/// weight 0 do not hold.
std::vector<int> PartsOf(const PoseGraph& graph, const std::vector<double>& weights);

}  // namespace dsg::ingest
