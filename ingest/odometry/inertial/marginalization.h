// SPDX-License-Identifier: Apache-2.0
// What is left of a window of states when its oldest ones leave: a prior on those that stay.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/inertial/linear_factor.h"

namespace ceres {
class CostFunction;
}

namespace dsg::ingest {

/// residual + jacobian * (what the blocks have moved by since), squared and halved.
struct LinearPrior {
  /// The caller's blocks that stay, in the order in which the factors name them first.
  std::vector<double*> blocks;
  /// Numbers of each, and their values at the linearisation, one block after the other.
  std::vector<int> sizes;
  std::vector<double> point;
  /// A column for each number of a step: six for a pose. At most as many rows as columns.
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;
};

/// Eliminates `dropped` from the factors that touch them: the Schur complement, by Householder QR
/// of the Jacobians, which loses half as many digits as forming it of their squares does. What
/// cannot be observed stays without information.
///
/// The factors are linearised where their blocks are now, weighed by their loss there, and never
/// again (first estimates); a prior from an earlier call takes part as a factor with its Jacobian
/// as it was. `held` are blocks that the solver does not move: they get no column. Dropped blocks
/// are eliminated in the given order, so landmarks belong before poses.
///
/// Errors: FIELD_INVALID naming the factor, when its blocks do not fit its cost function, or its
/// numbers are not finite. Nothing of the caller changes. Cost: rows times the square of columns;
/// 8 ms for 40 landmarks that 12 poses saw.
absl::StatusOr<LinearPrior> Marginalize(std::span<const WindowFactor> factors,
                                        std::span<double* const> dropped,
                                        std::span<double* const> held);

/// The prior for the blocks that it names, in their order. Its Jacobian is constant.
/// Requires: the prior has rows.
std::unique_ptr<ceres::CostFunction> MakePriorFactor(LinearPrior prior);

}  // namespace dsg::ingest
