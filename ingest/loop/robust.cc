// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/robust.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>

#include "ingest/loop/belief.h"
#include "ingest/loop/chi_square.h"
#include "ingest/loop/graduated.h"
#include "ingest/loop/loop_support.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Numerical, no options: on the way to the last solution nothing is gained by the last digits, and
// the last one is solved to RobustOptions::optimize.
constexpr double kRoughTolerance = 1e-4;
constexpr int kRoughIterationCountMax = 8;

std::vector<double> WeightsFor(const std::vector<bool>& is_kept) {
  std::vector<double> weights;
  for (const bool is_one : is_kept) weights.push_back(is_one ? 1.0 : 0.0);
  return weights;
}

// One run of OptimizeRobustly. Sets of edges hold all odometry.
class RobustSolver {
 public:
  RobustSolver(const PoseGraph& graph, const RobustOptions& options);

  absl::StatusOr<RobustResult> Run();

 private:
  absl::StatusOr<std::vector<bool>> Believe();
  absl::Status FindSupported();
  absl::StatusOr<std::vector<bool>> Grow(std::vector<bool> is_believed);
  absl::StatusOr<std::vector<bool>> GraduateDoubtful(const std::vector<bool>& is_believed);
  absl::StatusOr<std::vector<bool>> Confirmed(const std::vector<Pose3d>& poses,
                                              const std::vector<bool>& is_kept,
                                              const std::vector<bool>& is_believed) const;
  absl::StatusOr<RobustResult> Settle(std::vector<Pose3d> poses, std::vector<bool> is_kept) const;

  Belief BeliefAt(const std::vector<Pose3d>& poses, const std::vector<bool>& is_believed,
                  double gate) const;
  double ResidualOf(const RelativePose& edge, const std::vector<Pose3d>& poses) const;
  double TruncatedCost(const std::vector<Pose3d>& poses,
                       const std::vector<bool>& is_candidate) const;
  std::vector<bool> InGate(const std::vector<Pose3d>& poses, std::vector<bool> is_kept) const;

  absl::StatusOr<std::vector<Pose3d>> RoughPoses(const std::vector<bool>& is_kept);
  absl::StatusOr<Optimized> LastPoses(const std::vector<bool>& is_kept,
                                      const std::vector<Pose3d>& poses,
                                      bool has_covariance = false) const;
  absl::StatusOr<std::vector<Pose3d>> GraduatedPoses(const std::vector<Pose3d>& poses,
                                                     const std::vector<bool>& is_candidate) const;

  const PoseGraph& graph_;
  RobustOptions options_;
  const std::vector<bool> is_odometry_;
  // With the wanted confidence one right loop passes this,
  double gate_ = 0.0;
  // and all right loops pass that.
  double keep_gate_ = 0.0;
  // Loops that other loops bear out.
  std::vector<bool> is_supported_;
  // Whatever graduation had to decide on.
  std::vector<bool> is_graduated_;
  // The last answer of RoughPoses, and of WithPossible for poses of it: each is slow, and asked for
  // again where nothing has changed.
  std::vector<bool> rough_kept_;
  std::vector<Pose3d> rough_poses_;
  std::vector<bool> judged_believed_;
  std::vector<bool> is_possible_;
};

std::vector<bool> OdometryOf(const PoseGraph& graph) {
  std::vector<bool> is_odometry;
  for (const RelativePose& edge : graph.edges) is_odometry.push_back(!edge.is_loop);
  return is_odometry;
}

RobustSolver::RobustSolver(const PoseGraph& graph, const RobustOptions& options)
    : graph_(graph),
      options_(options),
      is_odometry_(OdometryOf(graph)),
      gate_(ChiSquareGate(options.confidence, graph.is_planar)),
      is_supported_(graph.edges.size(), true),
      is_graduated_(graph.edges.size(), false) {
  const auto loop_count = std::count(is_odometry_.begin(), is_odometry_.end(), false);
  const double each = (1.0 - options.confidence) / std::max(1.0, static_cast<double>(loop_count));
  keep_gate_ = ChiSquareGate(1.0 - each, graph.is_planar);
  if (!options_.on_work || options_.optimize.on_iteration) return;
  // Of all solutions together: nobody knows how many there will be.
  const auto count = std::make_shared<int64_t>(0);
  options_.optimize.on_iteration = [tell = options_.on_work, count](int, double) {
    tell("solving the path, step", ++*count, 0);
  };
}

Belief RobustSolver::BeliefAt(const std::vector<Pose3d>& poses,
                              const std::vector<bool>& is_believed, double gate) const {
  return Belief(graph_, poses, is_believed, gate, options_.evidence, options_.on_work);
}

double RobustSolver::ResidualOf(const RelativePose& edge, const std::vector<Pose3d>& poses) const {
  return SquaredResidual(edge, graph_.is_planar, poses[Index(edge.from)], poses[Index(edge.to)]);
}

double RobustSolver::TruncatedCost(const std::vector<Pose3d>& poses,
                                   const std::vector<bool>& is_candidate) const {
  double cost = 0.0;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (!is_candidate[e]) continue;
    const double squared = ResidualOf(graph_.edges[e], poses);
    cost += is_odometry_[e] ? squared : std::min(squared, keep_gate_);
  }
  return cost;
}

// The edges of `is_kept` without the loops that the poses contradict.
std::vector<bool> RobustSolver::InGate(const std::vector<Pose3d>& poses,
                                       std::vector<bool> is_kept) const {
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (is_odometry_[e] || !is_kept[e]) continue;
    is_kept[e] = ResidualOf(graph_.edges[e], poses) <= keep_gate_;
  }
  return is_kept;
}

absl::StatusOr<std::vector<Pose3d>> RobustSolver::RoughPoses(const std::vector<bool>& is_kept) {
  if (!rough_poses_.empty() && is_kept == rough_kept_) return rough_poses_;
  OptimizeOptions optimize = options_.optimize;
  optimize.weights = WeightsFor(is_kept);
  optimize.tolerance = std::max(optimize.tolerance, kRoughTolerance);
  optimize.has_covariance = false;
  DSG_ASSIGN_OR_RETURN(Optimized optimized, Optimize(graph_, optimize));
  rough_kept_ = is_kept;
  rough_poses_ = std::move(optimized.poses);
  return rough_poses_;
}

absl::StatusOr<Optimized> RobustSolver::LastPoses(const std::vector<bool>& is_kept,
                                                  const std::vector<Pose3d>& poses,
                                                  bool has_covariance) const {
  PoseGraph moved = graph_;
  moved.poses = poses;
  OptimizeOptions optimize = options_.optimize;
  optimize.weights = WeightsFor(is_kept);
  optimize.is_chordal_start = false;
  optimize.has_covariance = has_covariance;
  return Optimize(moved, optimize);
}

absl::StatusOr<std::vector<Pose3d>> RobustSolver::GraduatedPoses(
    const std::vector<Pose3d>& poses, const std::vector<bool>& is_candidate) const {
  GraduationOptions graduation;
  graduation.optimize = options_.optimize;
  graduation.optimize.tolerance = std::max(options_.optimize.tolerance, kRoughTolerance);
  graduation.optimize.iteration_count_max =
      std::min(options_.optimize.iteration_count_max, kRoughIterationCountMax);
  graduation.gate = keep_gate_;
  graduation.factor = options_.graduation;
  graduation.step_count_max = options_.graduation_count_max;
  DSG_ASSIGN_OR_RETURN(Graduation graduated, Graduate(graph_, poses, is_candidate, graduation));
  return std::move(graduated.poses);
}

// How large the noise is comes from loops that are likely right; once it is known, agreement tells
// more.
absl::Status RobustSolver::FindSupported() {
  const std::vector<bool> is_likely =
      LikelyEdges(graph_, gate_, options_.evidence, options_.on_work);
  DSG_ASSIGN_OR_RETURN(const std::vector<Pose3d> poses, RoughPoses(is_likely));
  const double noise_scale = NoiseScaleOf(graph_, poses, is_likely, options_.evidence);
  is_supported_ = SupportedEdges(graph_, gate_, noise_scale, options_.wrong_count_max,
                                 options_.evidence, options_.on_work);
  return absl::OkStatus();
}

// Loops that fit where what is believed leaves wrong ones no room, and so on from there.
absl::StatusOr<std::vector<bool>> RobustSolver::Grow(std::vector<bool> is_believed) {
  for (int round = 0; round < options_.belief_round_count_max; ++round) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Pose3d> poses, RoughPoses(is_believed));
    const Belief belief = BeliefAt(poses, is_believed, keep_gate_);
    std::vector<bool> is_convincing =
        belief.WithConvincing(is_supported_, options_.wrong_count_max);
    judged_believed_ = is_believed;
    is_possible_ = belief.WithPossible();
    if (is_convincing == is_believed) break;
    is_believed = std::move(is_convincing);
  }
  return is_believed;
}

// What is believed, and loops that can only be judged together: those that graduation keeps and
// that the other loops it keeps confirm.
absl::StatusOr<std::vector<bool>> RobustSolver::GraduateDoubtful(
    const std::vector<bool>& is_believed) {
  DSG_ASSIGN_OR_RETURN(std::vector<Pose3d> poses, RoughPoses(is_believed));
  if (judged_believed_ != is_believed) {
    judged_believed_ = is_believed;
    is_possible_ = BeliefAt(poses, is_believed, keep_gate_).WithPossible();
  }
  const std::vector<bool> is_candidate = is_possible_;
  const auto believed_count = std::count(is_believed.begin(), is_believed.end(), true);
  const auto doubtful_count =
      std::count(is_candidate.begin(), is_candidate.end(), true) - believed_count;
  const auto odometry_count = std::count(is_odometry_.begin(), is_odometry_.end(), true);
  if (static_cast<double>(doubtful_count) <=
      options_.doubtful_share_min * static_cast<double>(believed_count - odometry_count)) {
    return is_believed;
  }
  for (size_t e = 0; e < is_candidate.size(); ++e) {
    if (is_candidate[e]) is_graduated_[e] = true;
  }
  DSG_ASSIGN_OR_RETURN(std::vector<Pose3d> first, GraduatedPoses(poses, is_candidate));
  // Long chains that only doubtful loops hold may lie in another valley than the solution.
  if (options_.optimize.is_chordal_start) {
    const std::vector<Pose3d> chordal = ChordalStart(graph_, WeightsFor(is_candidate));
    DSG_ASSIGN_OR_RETURN(std::vector<Pose3d> second, GraduatedPoses(chordal, is_candidate));
    if (TruncatedCost(second, is_candidate) < TruncatedCost(first, is_candidate)) {
      std::swap(first, second);
    }
  }
  return Confirmed(first, InGate(first, is_candidate), is_believed);
}

// What is believed, and those of `is_kept` that the others confirm.
absl::StatusOr<std::vector<bool>> RobustSolver::Confirmed(
    const std::vector<Pose3d>& poses, const std::vector<bool>& is_kept,
    const std::vector<bool>& is_believed) const {
  // To the last digits: what a loop hides by drawing the poses towards itself is a large multiple
  // of a small residual.
  DSG_ASSIGN_OR_RETURN(const Optimized settled, LastPoses(is_kept, poses));
  Belief belief = BeliefAt(settled.poses, is_kept, gate_);
  std::vector<bool> is_confirmed = is_believed;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (!is_kept[e] || is_believed[e]) continue;
    const Belief::Verdict verdict = belief.VerdictOf(static_cast<int>(e), options_.wrong_share_max);
    is_confirmed[e] = verdict == Belief::Verdict::kConfirmed;
    if (verdict != Belief::Verdict::kContradicted) continue;
    // Too large a multiple may be an error of the first order; poses without the loop have none.
    std::vector<bool> is_other = is_kept;
    is_other[e] = false;
    DSG_ASSIGN_OR_RETURN(const Optimized without, LastPoses(is_other, settled.poses));
    is_confirmed[e] = BeliefAt(without.poses, is_other, gate_).WithPossible()[e];
  }
  return is_confirmed;
}

absl::StatusOr<std::vector<bool>> RobustSolver::Believe() {
  DSG_RETURN_IF_ERROR(FindSupported());
  std::vector<bool> is_believed = is_supported_;
  for (int round = 0; round < options_.graduation_round_count_max; ++round) {
    DSG_ASSIGN_OR_RETURN(is_believed, Grow(std::move(is_believed)));
    if (!options_.is_graduated_used) break;
    DSG_ASSIGN_OR_RETURN(std::vector<bool> is_confirmed, GraduateDoubtful(is_believed));
    if (is_confirmed == is_believed) break;
    is_believed = std::move(is_confirmed);
  }
  return is_believed;
}

// The last solution, and the loops that it agrees with.
absl::StatusOr<RobustResult> RobustSolver::Settle(std::vector<Pose3d> poses,
                                                  std::vector<bool> is_kept) const {
  RobustResult result;
  result.is_kept = InGate(poses, std::move(is_kept));
  for (int round = 0;; ++round) {
    DSG_ASSIGN_OR_RETURN(result.optimized, LastPoses(result.is_kept, poses));
    poses = result.optimized.poses;
    std::vector<bool> is_agreeing = result.is_kept;
    // Loops on the edge of the gate may come and go for ever; at last they may only go.
    if (options_.is_pairwise_used && round < options_.belief_round_count_max) {
      is_agreeing = BeliefAt(poses, result.is_kept, keep_gate_)
                        .WithConvincing(is_supported_, options_.wrong_count_max);
    }
    is_agreeing = InGate(poses, std::move(is_agreeing));
    if (is_agreeing == result.is_kept) break;
    result.is_kept = std::move(is_agreeing);
  }
  if (options_.optimize.has_covariance) {
    if (options_.on_work) options_.on_work("finding covariances of poses", 0, std::ssize(poses));
    DSG_ASSIGN_OR_RETURN(result.optimized, LastPoses(result.is_kept, poses, true));
  }
  return result;
}

absl::StatusOr<RobustResult> RobustSolver::Run() {
  std::vector<bool> is_believed(graph_.edges.size(), true);
  if (options_.is_pairwise_used) {
    DSG_ASSIGN_OR_RETURN(is_believed, Believe());
  }
  DSG_ASSIGN_OR_RETURN(std::vector<Pose3d> poses, RoughPoses(is_believed));
  if (options_.is_graduated_used) {
    DSG_ASSIGN_OR_RETURN(poses, GraduatedPoses(poses, is_believed));
  }
  DSG_ASSIGN_OR_RETURN(RobustResult result, Settle(std::move(poses), is_believed));
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (is_odometry_[e]) continue;
    ++result.loop_count;
    if (result.is_kept[e]) {
      ++result.kept_count;
    } else if (is_believed[e] || is_graduated_[e]) {
      ++result.rejected_by_graduation_count;
    } else {
      ++result.rejected_by_consistency_count;
    }
  }
  return result;
}

}  // namespace

absl::StatusOr<RobustResult> OptimizeRobustly(const PoseGraph& graph,
                                              const RobustOptions& options) {
  // Not a step, only the checks of what comes in.
  OptimizeOptions checked = options.optimize;
  checked.iteration_count_max = 0;
  checked.is_chordal_start = false;
  checked.has_covariance = false;
  DSG_RETURN_IF_ERROR(Optimize(graph, checked).status());
  return RobustSolver(graph, options).Run();
}

std::vector<bool> ConsistentLoops(const PoseGraph& graph, double confidence) {
  return ConsistentEdges(graph, ChiSquareGate(confidence, graph.is_planar));
}

}  // namespace dsg::ingest
