// SPDX-License-Identifier: Apache-2.0
// How uncertain poses are once they agree with their measurements.
// Refuses covariances between poses: only those within each one are formed.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/pose_graph.h"

namespace dsg::ingest {

/// The blocks of `size` rows on the diagonal of the inverse of `normal` (lower triangle), found
/// from its sparse factor without the rest of the inverse; empty if it is not positive definite.
///
/// Requires: diagonal blocks are stored whole.
/// Source: Takahashi et al. 1973.
std::vector<Eigen::MatrixXd> DiagonalOfInverse(const Eigen::SparseMatrix<double>& normal, int size);

/// As Optimized::covariances. `anchors` have none.
/// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for more poses than kCovariancePosesMax.
absl::StatusOr<std::vector<Matrix6d>> CovariancesOf(const PoseGraph& graph,
                                                    const std::vector<Pose3d>& poses,
                                                    const std::vector<int>& anchors,
                                                    const OptimizeOptions& options);

}  // namespace dsg::ingest
