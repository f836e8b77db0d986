// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/linear_factor.h"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <algorithm>
#include <cmath>

#include "ingest/solver/pose_block.h"

namespace dsg::ingest {

int StepSizeOf(int block_size) { return block_size == kPoseBlockSize ? kPoseStepSize : block_size; }

std::optional<LinearFactor> Linearized(const WindowFactor& factor) {
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const int rows = factor.cost->num_residuals();
  std::vector<RowMatrix> jacobians;
  std::vector<double*> outputs;
  for (const int size : factor.cost->parameter_block_sizes()) {
    jacobians.emplace_back(RowMatrix::Zero(rows, size));
  }
  for (RowMatrix& jacobian : jacobians) outputs.push_back(jacobian.data());
  LinearFactor linear;
  linear.residual = Eigen::VectorXd::Zero(rows);
  if (!factor.cost->Evaluate(factor.blocks.data(), linear.residual.data(), outputs.data()) ||
      !linear.residual.allFinite()) {
    return std::nullopt;
  }
  double weight = 1.0;
  if (factor.loss != nullptr) {
    double rho[3];
    factor.loss->Evaluate(linear.residual.squaredNorm(), rho);
    weight = std::sqrt(std::max(0.0, rho[1]));
  }
  linear.residual *= weight;
  for (const RowMatrix& jacobian : jacobians) {
    linear.by_block.emplace_back(weight *
                                 jacobian.leftCols(StepSizeOf(static_cast<int>(jacobian.cols()))));
    if (!linear.by_block.back().allFinite()) return std::nullopt;
  }
  return linear;
}

}  // namespace dsg::ingest
