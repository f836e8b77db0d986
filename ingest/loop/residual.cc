// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/residual.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// q and -q are one rotation; the one with w >= 0 turns by at most pi.
Quaterniond ShortWay(const Quaterniond& q) {
  return q.w() < 0.0 ? Quaterniond(-q.w(), -q.x(), -q.y(), -q.z()) : q;
}

double PlanarRotationError(double angle, RotationError error) {
  return error == RotationError::kVector ? std::remainder(angle, 2.0 * std::numbers::pi)
                                         : 2.0 * std::sin(0.5 * angle);
}

}  // namespace

RotationError RotationErrorOf(PoseObjective objective, bool is_planar) {
  const bool is_sine = objective == PoseObjective::kSeSync ||
                       (objective == PoseObjective::kQuaternion && !is_planar);
  return is_sine ? RotationError::kTwiceSine : RotationError::kVector;
}

Matrix6d InformationOf(const RelativePose& edge, bool is_planar, PoseObjective objective) {
  if (objective == PoseObjective::kSeSync) {
    const SeSyncWeights weights = WeightsOf(edge, is_planar);
    Vector6d diagonal;
    diagonal << Vector3d::Constant(weights.tau), Vector3d::Constant(2.0 * weights.kappa);
    return diagonal.asDiagonal();
  }
  Matrix6d information = edge.information;
  if (objective == PoseObjective::kQuaternion && !is_planar) {
    information.topRightCorner<3, 3>() *= 0.5;
    information.bottomLeftCorner<3, 3>() *= 0.5;
    information.bottomRightCorner<3, 3>() *= 0.25;
  }
  return information;
}

Vector6d SpatialResidual(const Pose3d& from_T_to, const Pose3d& map_T_from, const Pose3d& map_T_to,
                         RotationError error, Matrix6d* by_from, Matrix6d* by_to) {
  const Matrix3d from_R_map = map_T_from.orientation.conjugate().toRotationMatrix();
  const Matrix3d z_transposed = from_T_to.orientation.conjugate().toRotationMatrix();
  const Vector3d to_from = from_R_map * (map_T_to.position - map_T_from.position);
  const Quaterniond turn = map_T_from.orientation.conjugate() * map_T_to.orientation;
  const Quaterniond rest = ShortWay(from_T_to.orientation.conjugate() * turn);
  const bool is_vector = error == RotationError::kVector;

  Vector6d residual;
  residual.head<3>() = z_transposed * (to_from - from_T_to.position);
  residual.tail<3>() = is_vector ? RotationVectorOf(rest) : Vector3d(2.0 * rest.vec());
  if (by_from == nullptr || by_to == nullptr) return residual;

  by_from->setZero();
  by_to->setZero();
  by_to->topLeftCorner<3, 3>() = z_transposed * from_R_map;
  by_from->topLeftCorner<3, 3>() = -by_to->topLeftCorner<3, 3>();
  by_from->topRightCorner<3, 3>() = z_transposed * CrossMatrix(to_from);
  by_to->bottomRightCorner<3, 3>() =
      is_vector ? InverseRightJacobian(residual.tail<3>())
                : Matrix3d(rest.w() * Matrix3d::Identity() + CrossMatrix(rest.vec()));
  by_from->bottomRightCorner<3, 3>() =
      -by_to->bottomRightCorner<3, 3>() * turn.conjugate().toRotationMatrix();
  return residual;
}

Vector3d PlanarOf(const Pose3d& pose) {
  const Quaterniond& q = pose.orientation;
  return {pose.position.x(), pose.position.y(),
          std::remainder(2.0 * std::atan2(q.z(), q.w()), 2.0 * std::numbers::pi)};
}

Pose3d FromPlanar(const Vector3d& planar, double z_m) {
  const double half = 0.5 * std::remainder(planar.z(), 2.0 * std::numbers::pi);
  return {Vector3d(planar.x(), planar.y(), z_m),
          Quaterniond(std::cos(half), 0.0, 0.0, std::sin(half))};
}

Vector3d PlanarResidual(const Vector3d& from_T_to, const Vector3d& map_T_from,
                        const Vector3d& map_T_to, RotationError error, Matrix3d* by_from,
                        Matrix3d* by_to) {
  const Eigen::Matrix2d from_R_map = Eigen::Rotation2Dd(-map_T_from.z()).toRotationMatrix();
  const Eigen::Matrix2d z_transposed = Eigen::Rotation2Dd(-from_T_to.z()).toRotationMatrix();
  const Eigen::Vector2d to_from = from_R_map * (map_T_to - map_T_from).head<2>();
  const double angle = map_T_to.z() - map_T_from.z() - from_T_to.z();

  Vector3d residual;
  residual.head<2>() = z_transposed * (to_from - from_T_to.head<2>());
  residual.z() = PlanarRotationError(angle, error);
  if (by_from == nullptr || by_to == nullptr) return residual;

  by_from->setZero();
  by_to->setZero();
  by_to->topLeftCorner<2, 2>() = z_transposed * from_R_map;
  by_from->topLeftCorner<2, 2>() = -by_to->topLeftCorner<2, 2>();
  by_from->topRightCorner<2, 1>() = z_transposed * Eigen::Vector2d(to_from.y(), -to_from.x());
  (*by_to)(2, 2) = error == RotationError::kVector ? 1.0 : std::cos(0.5 * angle);
  (*by_from)(2, 2) = -(*by_to)(2, 2);
  return residual;
}

Matrix3d PlanarBlock(const Matrix6d& matrix) {
  Matrix3d block;
  block.topLeftCorner<2, 2>() = matrix.topLeftCorner<2, 2>();
  block.topRightCorner<2, 1>() = matrix.block<2, 1>(0, 5);
  block.bottomLeftCorner<1, 2>() = matrix.block<1, 2>(5, 0);
  block(2, 2) = matrix(5, 5);
  return block;
}

namespace {

double SquaredResidualOf(const RelativePose& edge, bool is_planar, const Pose3d& map_T_from,
                         const Pose3d& map_T_to, PoseObjective objective) {
  const RotationError error = RotationErrorOf(objective, is_planar);
  const Matrix6d information = InformationOf(edge, is_planar, objective);
  if (is_planar) {
    const Vector3d residual = PlanarResidual(PlanarOf(edge.from_T_to), PlanarOf(map_T_from),
                                             PlanarOf(map_T_to), error, nullptr, nullptr);
    return residual.dot(PlanarBlock(information) * residual);
  }
  const Vector6d residual =
      SpatialResidual(edge.from_T_to, map_T_from, map_T_to, error, nullptr, nullptr);
  return residual.dot(information * residual);
}

}  // namespace

double SquaredResidual(const RelativePose& edge, bool is_planar, const Pose3d& map_T_from,
                       const Pose3d& map_T_to) {
  return SquaredResidualOf(edge, is_planar, map_T_from, map_T_to, PoseObjective::kGeodesic);
}

double CostOf(const PoseGraph& graph, const std::vector<Pose3d>& poses,
              const std::vector<double>& weights, PoseObjective objective) {
  double sum = 0.0;
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const double weight = weights.empty() ? 1.0 : weights[i];
    if (weight == 0.0) continue;
    const RelativePose& edge = graph.edges[i];
    sum += weight * SquaredResidualOf(edge, graph.is_planar, poses[static_cast<size_t>(edge.from)],
                                      poses[static_cast<size_t>(edge.to)], objective);
  }
  return 0.5 * sum;
}

SeSyncWeights WeightsOf(const RelativePose& edge, bool is_planar) {
  const Matrix6d& information = edge.information;
  if (is_planar) {
    return {information(5, 5), 2.0 / information.topLeftCorner<2, 2>().inverse().trace()};
  }
  return {1.5 / information.bottomRightCorner<3, 3>().inverse().trace(),
          3.0 / information.topLeftCorner<3, 3>().inverse().trace()};
}

}  // namespace dsg::ingest
