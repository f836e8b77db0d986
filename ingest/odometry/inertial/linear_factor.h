// SPDX-License-Identifier: Apache-2.0
// A residual block of Ceres where its parameter blocks are now, as linear equations.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace ceres {
class CostFunction;
class LossFunction;
}  // namespace ceres

namespace dsg::ingest {

/// A residual block as it was given to Ceres.
struct WindowFactor {
  const ceres::CostFunction* cost = nullptr;
  /// Null: squares.
  const ceres::LossFunction* loss = nullptr;
  /// In the order of the cost function, each once. A block of seven numbers is a pose
  /// (pose_block.h), others are vectors.
  std::vector<double*> blocks;
};

/// Numbers of a block's step: six of a pose.
int StepSizeOf(int block_size);

/// residual + the sum of by_block * (step of the block), weighed by the loss.
struct LinearFactor {
  Eigen::VectorXd residual;
  /// In the order of the factor's blocks, a column for each number of a step.
  std::vector<Eigen::MatrixXd> by_block;
};

/// nullopt where it cannot be evaluated, or is not finite. Requires: as many blocks as the cost
/// function takes.
std::optional<LinearFactor> Linearized(const WindowFactor& factor);

}  // namespace dsg::ingest
