// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/optimize.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <memory>

#include "absl/strings/str_cat.h"
#include "ingest/loop/pose_covariance.h"
#include "ingest/loop/residual.h"
#include "ingest/loop/start.h"
#include "ingest/solver/pose_block.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// A planar pose is x, y, yaw; a spatial one a pose block.
using Block = std::array<double, kPoseBlockSize>;
using RowMatrix67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

class SpatialCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  SpatialCost(const RelativePose& edge, const Matrix6d& information, RotationError error)
      : from_T_to_(edge.from_T_to), whitening_(information.llt().matrixU()), error_(error) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Pose3d from = PoseOfBlock(blocks[0]);
    const Pose3d to = PoseOfBlock(blocks[1]);
    Eigen::Map<Vector6d> out(residuals);
    if (jacobians == nullptr) {
      out = whitening_ * SpatialResidual(from_T_to_, from, to, error_, nullptr, nullptr);
      return true;
    }
    Matrix6d by_from;
    Matrix6d by_to;
    out = whitening_ * SpatialResidual(from_T_to_, from, to, error_, &by_from, &by_to);
    for (int i = 0; i < 2; ++i) {
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<RowMatrix67> jacobian(jacobians[i]);
      jacobian.leftCols<6>() = whitening_ * (i == 0 ? by_from : by_to);
      jacobian.col(6).setZero();
    }
    return true;
  }

 private:
  const Pose3d from_T_to_;
  const Matrix6d whitening_;
  const RotationError error_;
};

class PlanarCost : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  PlanarCost(const RelativePose& edge, const Matrix6d& information, RotationError error)
      : from_T_to_(PlanarOf(edge.from_T_to)),
        whitening_(PlanarBlock(information).llt().matrixU()),
        error_(error) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> from(blocks[0]);
    const Eigen::Map<const Eigen::Vector3d> to(blocks[1]);
    Eigen::Matrix3d by_from;
    Eigen::Matrix3d by_to;
    Eigen::Map<Eigen::Vector3d> out(residuals);
    out = whitening_ * PlanarResidual(from_T_to_, from, to, error_, &by_from, &by_to);
    if (jacobians == nullptr) return true;
    using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    if (jacobians[0] != nullptr) Eigen::Map<RowMatrix3>{jacobians[0]} = whitening_ * by_from;
    if (jacobians[1] != nullptr) Eigen::Map<RowMatrix3>{jacobians[1]} = whitening_ * by_to;
    return true;
  }

 private:
  const Eigen::Vector3d from_T_to_;
  const Eigen::Matrix3d whitening_;
  const RotationError error_;
};

class Listener : public ceres::IterationCallback {
 public:
  explicit Listener(const std::function<void(int, double)>& tell) : tell_(tell) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    tell_(summary.iteration, summary.cost);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<void(int, double)>& tell_;
};

absl::Status Refuse(const std::string& message) {
  return MakeError(Reason::kFieldInvalid, message);
}

bool IsPositiveDefinite(const Matrix6d& information, bool is_planar) {
  if (is_planar) return PlanarBlock(information).llt().info() == Eigen::Success;
  return information.llt().info() == Eigen::Success;
}

absl::Status CheckEdge(const PoseGraph& graph, size_t index) {
  const RelativePose& edge = graph.edges[index];
  const int pose_count = static_cast<int>(graph.poses.size());
  const std::string name = absl::StrCat("edge ", index, " (line ", edge.line, ")");
  if (edge.from < 0 || edge.from >= pose_count || edge.to < 0 || edge.to >= pose_count) {
    return Refuse(absl::StrCat(name, " joins poses ", edge.from, " and ", edge.to,
                               " of a graph of ", pose_count));
  }
  if (edge.from == edge.to) {
    return Refuse(absl::StrCat(name, " joins pose ", edge.from, " to itself; leave it out"));
  }
  if (!IsValidPose(edge.from_T_to)) {
    return Refuse(absl::StrCat(name, " measures no rigid transform of finite numbers"));
  }
  if (!edge.information.allFinite() || !IsPositiveDefinite(edge.information, graph.is_planar)) {
    return Refuse(absl::StrCat(name, " has no positive definite information matrix; leave it out"));
  }
  return absl::OkStatus();
}

absl::Status CheckGraph(const PoseGraph& graph, const OptimizeOptions& options) {
  if (graph.poses.size() > size_t{1} << 27 || graph.edges.size() > size_t{1} << 27) {
    return Refuse(absl::StrCat("a graph of ", graph.poses.size(), " poses and ", graph.edges.size(),
                               " edges; at most 2^27 of each"));
  }
  if (!options.weights.empty() && options.weights.size() != graph.edges.size()) {
    return Refuse(absl::StrCat(options.weights.size(), " weights for ", graph.edges.size(),
                               " edges; give one for each or none"));
  }
  for (size_t i = 0; i < options.weights.size(); ++i) {
    if (!(options.weights[i] >= 0.0 && std::isfinite(options.weights[i]))) {
      return Refuse(absl::StrCat("weight ", i, " is ", options.weights[i],
                                 "; it must be finite and not negative"));
    }
  }
  for (size_t i = 0; i < graph.poses.size(); ++i) {
    if (!IsValidPose(graph.poses[i])) {
      return Refuse(absl::StrCat("pose ", i, " is no rigid transform of finite numbers"));
    }
  }
  if (!graph.poses.empty() &&
      (options.fixed_pose < 0 || options.fixed_pose >= static_cast<int>(graph.poses.size()))) {
    return Refuse(absl::StrCat("fixed pose ", options.fixed_pose, " of a graph of ",
                               graph.poses.size(), " poses"));
  }
  for (size_t i = 0; i < graph.edges.size(); ++i) DSG_RETURN_IF_ERROR(CheckEdge(graph, i));
  return absl::OkStatus();
}

std::vector<Block> BlocksOf(const PoseGraph& graph, const std::vector<Pose3d>& poses) {
  std::vector<Block> blocks(poses.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    double* block = blocks[i].data();
    if (graph.is_planar) {
      Eigen::Map<Eigen::Vector3d>{block} = PlanarOf(poses[i]);
    } else {
      WritePoseBlock(poses[i], block);
    }
  }
  return blocks;
}

void AddEdges(const PoseGraph& graph, const OptimizeOptions& options, ceres::Manifold* manifold,
              std::vector<Block>* blocks, ceres::Problem* problem) {
  const RotationError error = RotationErrorOf(options.objective, graph.is_planar);
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const RelativePose& edge = graph.edges[i];
    const double weight = options.weights.empty() ? 1.0 : options.weights[i];
    if (weight == 0.0) continue;
    const Matrix6d information = weight * InformationOf(edge, graph.is_planar, options.objective);
    double* from = (*blocks)[static_cast<size_t>(edge.from)].data();
    double* to = (*blocks)[static_cast<size_t>(edge.to)].data();
    if (graph.is_planar) {
      problem->AddResidualBlock(new PlanarCost(edge, information, error), nullptr, from, to);
      continue;
    }
    problem->AddParameterBlock(from, 7, manifold);
    problem->AddParameterBlock(to, 7, manifold);
    problem->AddResidualBlock(new SpatialCost(edge, information, error), nullptr, from, to);
  }
}

ceres::Solver::Options SolverOptionsOf(const OptimizeOptions& options) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Without BLAS, whose sums depend on the machine and its threads.
  solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  solver.num_threads = 1;
  solver.max_num_iterations = options.iteration_count_max;
  solver.function_tolerance = options.tolerance;
  // Graphs without noise end at a cost of nothing, where nothing is a share of it.
  solver.gradient_tolerance = 1e-12;
  solver.parameter_tolerance = 1e-14;
  solver.logging_type = ceres::SILENT;
  return solver;
}

absl::Status Solve(const PoseGraph& graph, const OptimizeOptions& options,
                   const std::vector<int>& anchors, Optimized* optimized) {
  std::vector<Block> blocks = BlocksOf(graph, optimized->poses);
  const std::unique_ptr<ceres::Manifold> manifold = MakePoseManifold();
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  AddEdges(graph, options, manifold.get(), &blocks, &problem);
  for (const int anchor : anchors) {
    double* block = blocks[static_cast<size_t>(anchor)].data();
    if (problem.HasParameterBlock(block)) problem.SetParameterBlockConstant(block);
  }
  ceres::Solver::Options solver = SolverOptionsOf(options);
  Listener listener(options.on_iteration);
  if (options.on_iteration) solver.callbacks.push_back(&listener);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    return Refuse(absl::StrCat("the pose graph cannot be optimised: ", summary.message));
  }
  optimized->iteration_count = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  optimized->is_converged = summary.termination_type == ceres::CONVERGENCE;
  std::vector<bool> is_fixed(blocks.size(), false);
  for (const int anchor : anchors) is_fixed[static_cast<size_t>(anchor)] = true;
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (is_fixed[i]) continue;
    Pose3d& pose = optimized->poses[i];
    const double* block = blocks[i].data();
    pose = graph.is_planar ? FromPlanar(Eigen::Vector3d(block), pose.position.z())
                           : PoseOfBlock(block);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Optimized> Optimize(const PoseGraph& graph, const OptimizeOptions& options) {
  DSG_RETURN_IF_ERROR(CheckGraph(graph, options));
  Optimized optimized;
  optimized.is_converged = true;
  if (graph.poses.empty()) return optimized;
  const std::vector<int> parts = PartsOf(graph, options.weights);
  const std::vector<int> anchors = AnchorsOf(parts, options.fixed_pose);
  optimized.poses =
      options.is_chordal_start ? ChordalStartFrom(graph, options.weights, anchors) : graph.poses;
  optimized.start_cost = CostOf(graph, optimized.poses, options.weights, options.objective);
  if (!std::isfinite(optimized.start_cost)) {
    return Refuse("the pose graph's numbers are too large to be squared; check their units");
  }
  // Every pose on its own: nothing to solve.
  if (anchors.size() < graph.poses.size()) {
    DSG_RETURN_IF_ERROR(Solve(graph, options, anchors, &optimized));
  }
  optimized.cost = CostOf(graph, optimized.poses, options.weights, options.objective);
  if (options.has_covariance) {
    DSG_ASSIGN_OR_RETURN(optimized.covariances,
                         CovariancesOf(graph, optimized.poses, anchors, options));
  }
  return optimized;
}

}  // namespace dsg::ingest
