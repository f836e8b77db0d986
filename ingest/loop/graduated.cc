// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/graduated.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

double SquaredResidualIn(const PoseGraph& graph, const RelativePose& edge) {
  return SquaredResidual(edge, graph.is_planar, graph.poses[static_cast<size_t>(edge.from)],
                         graph.poses[static_cast<size_t>(edge.to)]);
}

// The weight of a loop of squared residual `squared` at the hardness `mu`.
double TruncatedWeight(double mu, double gate, double squared) {
  if (squared <= mu / (mu + 1.0) * gate) return 1.0;
  if (squared >= (mu + 1.0) / mu * gate) return 0.0;
  return std::clamp(std::sqrt(gate * mu * (mu + 1.0) / squared) - mu, 0.0, 1.0);
}

}  // namespace

absl::StatusOr<Graduation> Graduate(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                                    const std::vector<bool>& is_candidate,
                                    const GraduationOptions& options) {
  PoseGraph moved = graph;
  moved.poses = map_T_pose;
  OptimizeOptions optimize = options.optimize;
  optimize.is_chordal_start = false;
  optimize.has_covariance = false;
  Graduation result;
  result.weights.assign(graph.edges.size(), 1.0);
  double largest = 0.0;
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    if (!graph.edges[e].is_loop) continue;
    if (is_candidate[e]) {
      largest = std::max(largest, SquaredResidualIn(moved, moved.edges[e]));
    } else {
      result.weights[e] = 0.0;
    }
  }
  // Where even the largest residual is in the gate, one plain step is all there is to do: so hard a
  // cost is no option.
  double mu = largest > options.gate ? options.gate / (2.0 * largest - options.gate) : 1e6;
  while (result.step_count < options.step_count_max && !result.is_converged) {
    result.is_converged = true;
    for (size_t e = 0; e < graph.edges.size(); ++e) {
      if (!graph.edges[e].is_loop || !is_candidate[e]) continue;
      const double weight =
          TruncatedWeight(mu, options.gate, SquaredResidualIn(moved, moved.edges[e]));
      result.weights[e] = weight;
      result.is_converged = result.is_converged && (weight == 0.0 || weight == 1.0);
    }
    optimize.weights = result.weights;
    DSG_ASSIGN_OR_RETURN(Optimized optimized, Optimize(moved, optimize));
    moved.poses = std::move(optimized.poses);
    ++result.step_count;
    mu *= options.factor;
  }
  result.poses = std::move(moved.poses);
  return result;
}

}  // namespace dsg::ingest
