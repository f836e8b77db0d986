// SPDX-License-Identifier: Apache-2.0
// How sure a least-squares estimate is of some of its blocks.
#pragma once

#include <Eigen/Core>
#include <span>

#include "absl/status/statusor.h"
#include "ingest/odometry/inertial/marginalization.h"

namespace dsg::ingest {

/// Covariance of the steps of `wanted` (6 numbers of a pose, all of a vector), in their order, when
/// all factors are linearised where their blocks are, weighed by their loss. `landmarks` are blocks
/// of three numbers that are eliminated first, each by itself: no factor takes two of them, and
/// each is in one.
///
/// Errors: FIELD_INVALID when the factors do not determine the blocks, or are not finite.
/// Cost: rows times columns of each factor, and the cube of all columns but those of
/// landmarks.
absl::StatusOr<Eigen::MatrixXd> CovarianceOf(std::span<const WindowFactor> factors,
                                             std::span<double* const> landmarks,
                                             std::span<double* const> wanted);

}  // namespace dsg::ingest
