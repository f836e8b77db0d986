// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/chain_solver.h"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <cstddef>
#include <vector>

namespace dsg::ingest {
namespace {

/// Ceres wants rows first; null where it wants nothing.
template <int Rows, int N>
void Write(const Eigen::Matrix<double, Rows, N>& jacobian, double* values) {
  if (values == nullptr) return;
  for (int row = 0; row < Rows; ++row) {
    for (int column = 0; column < N; ++column) *values++ = jacobian(row, column);
  }
}

template <int N>
class TermCost : public ceres::SizedCostFunction<3, N> {
 public:
  explicit TermCost(const ChainTerm<N>& term) : term_(term) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> state(parameters[0]);
    Eigen::Map<Eigen::Vector3d> residual(residuals);
    residual = term_.Residual(state);
    if (jacobians != nullptr) Write(term_.jacobian, jacobians[0]);
    return true;
  }

 private:
  // The chain outlives the problem.
  const ChainTerm<N>& term_;
};

/// Square root of the link's information times what the link leaves unexplained.
template <int N>
class LinkCost : public ceres::SizedCostFunction<N, N, N> {
 public:
  LinkCost(const Eigen::Matrix<double, N, N>& information,
           const Eigen::Matrix<double, N, N>& transition)
      : after_(information.llt().matrixU()), before_(-after_ * transition) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> before(parameters[0]);
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> after(parameters[1]);
    Eigen::Map<Eigen::Matrix<double, N, 1>> residual(residuals);
    residual = before_ * before + after_ * after;
    if (jacobians == nullptr) return true;
    Write(before_, jacobians[0]);
    Write(after_, jacobians[1]);
    return true;
  }

 private:
  Eigen::Matrix<double, N, N> after_;
  Eigen::Matrix<double, N, N> before_;
};

/// The belief before the first term.
template <int N>
class InitialCost : public ceres::SizedCostFunction<N, N> {
 public:
  explicit InitialCost(const Eigen::Matrix<double, N, N>& information)
      : root_(information.llt().matrixU()) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> state(parameters[0]);
    Eigen::Map<Eigen::Matrix<double, N, 1>> residual(residuals);
    residual = root_ * state;
    if (jacobians != nullptr) Write(root_, jacobians[0]);
    return true;
  }

 private:
  Eigen::Matrix<double, N, N> root_;
};

ceres::Solver::Options Options() {
  ceres::Solver::Options options;
  options.max_num_iterations = 50;
  options.function_tolerance = 1e-9;
  options.parameter_tolerance = 1e-9;
  options.num_threads = 1;
  // A chain fills in next to nothing, and no BLAS with threads of its own takes part.
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

template <int N>
bool SolveWithCeres(StateChain<N>* chain) {
  ceres::Problem::Options problem_options;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  std::vector<Eigen::Matrix<double, N, 1>> states(chain->size());
  for (size_t i = 0; i < states.size(); ++i) {
    states[i] = chain->state(i);
    double* state = states[i].data();
    if (i == 0) {
      problem.AddResidualBlock(new InitialCost<N>(chain->initial_information()), nullptr, state);
    } else {
      problem.AddResidualBlock(
          new LinkCost<N>(chain->link_information(i), chain->link(i).transition), nullptr,
          states[i - 1].data(), state);
    }
    for (const ChainTerm<N>& term : chain->terms(i)) {
      ceres::LossFunction* loss =
          term.loss_scale > 0.0 ? new ceres::CauchyLoss(term.loss_scale) : nullptr;
      problem.AddResidualBlock(new TermCost<N>(term), loss, state);
    }
  }
  ceres::Solver::Summary summary;
  ceres::Solve(Options(), &problem, &summary);
  if (!summary.IsSolutionUsable()) return false;
  for (size_t i = 0; i < states.size(); ++i) *chain->mutable_state(i) = states[i];
  return true;
}

template bool SolveWithCeres<1>(StateChain<1>* chain);
template bool SolveWithCeres<3>(StateChain<3>* chain);
template bool SolveWithCeres<7>(StateChain<7>* chain);

}  // namespace dsg::ingest
