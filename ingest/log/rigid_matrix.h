// SPDX-License-Identifier: Apache-2.0
// Rigid transforms as files write them: 4x4 matrices of rounded numbers.
// Refuses matrices that are far from rigid: nobody knows what they mean.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

struct RigidMatrix {
  Pose3d pose;
  /// Largest element of |R^T R - I| before the rotation was made orthonormal.
  double deviation = 0.0;
};

/// The nearest rigid transform.
/// Errors: INVALID_ARGUMENT saying what is wrong, without saying where: callers know.
absl::StatusOr<RigidMatrix> ToRigid(const Eigen::Matrix4d& matrix);

}  // namespace dsg::ingest
