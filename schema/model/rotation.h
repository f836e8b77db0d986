// SPDX-License-Identifier: Apache-2.0
// Rotations as vectors (axis times angle, radians), and how they change with them: what solvers
// need of SO(3). Small turns are on the right: R becomes R RotationOf(turn).
// Source: Forster, Carlone, Dellaert, Scaramuzza, T-RO 2017, section III-A.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dsg {

/// CrossMatrix(a) * b = a x b.
Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v);

/// Exp: the rotation by a rotation vector of any length.
Eigen::Quaterniond RotationOf(const Eigen::Vector3d& vector);

/// Log: the shortest rotation vector, up to pi long. Requires: `rotation` is unit.
Eigen::Vector3d RotationVectorOf(const Eigen::Quaterniond& rotation);

/// RotationOf(v + d) = RotationOf(v) RotationOf(RightJacobian(v) d), to first order.
Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& vector);

/// Log(RotationOf(v) RotationOf(d)) = v + InverseRightJacobian(v) d, to first order.
/// Requires: `vector` is shorter than two pi.
Eigen::Matrix3d InverseRightJacobian(const Eigen::Vector3d& vector);

}  // namespace dsg
