// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

// Numerical, no options: where iterations have converged, and equations for six unknowns.
constexpr double kStepMinM = 1e-5;
constexpr size_t kPairCountMin = 6;

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

struct NormalEquations {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  size_t pair_count = 0;
};

int NearestOf(const ModelIndex& model, const Eigen::Vector3d& point_model, bool is_exact) {
  return is_exact ? model.Nearest(point_model) : model.NearestQuickly(point_model);
}

// Rotation about `pivot` first, then translation, both in the model's frame.
void AddPair(const Eigen::Vector3d& arm, const Eigen::Vector3d& offset,
             const Eigen::Vector3d& normal, double weight, double point_weight,
             NormalEquations* sums) {
  Vector6 row;
  row << arm.cross(normal), normal;
  sums->hessian += weight * row * row.transpose();
  sums->gradient += weight * normal.dot(offset) * row;
  // d(arm turned by w) = w x arm = -[arm]x w.
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << 0.0, arm.z(), -arm.y(), 1.0, 0.0, 0.0,  //
      -arm.z(), 0.0, arm.x(), 0.0, 1.0, 0.0,          //
      arm.y(), -arm.x(), 0.0, 0.0, 0.0, 1.0;
  sums->hessian += weight * point_weight * jacobian.transpose() * jacobian;
  sums->gradient += weight * point_weight * jacobian.transpose() * offset;
  ++sums->pair_count;
}

NormalEquations Collect(const ModelIndex& model, const std::vector<Eigen::Vector3d>& points_map,
                        const Pose3d& model_T_map, const Eigen::Vector3d& pivot, double gate_m,
                        const AlignmentOptions& options) {
  NormalEquations sums;
  for (const Eigen::Vector3d& point_map : points_map) {
    const Eigen::Vector3d point = model_T_map * point_map;
    const int nearest = NearestOf(model, point, options.is_exact);
    if (nearest < 0) continue;
    const Eigen::Vector3d offset = point - model.surface().points[static_cast<size_t>(nearest)];
    const double ratio = offset.squaredNorm() / (gate_m * gate_m);
    if (ratio >= 1.0) continue;
    AddPair(point - pivot, offset, model.surface().normals[static_cast<size_t>(nearest)],
            (1.0 - ratio) * (1.0 - ratio), options.point_weight, &sums);
  }
  return sums;
}

// The step that lessens the distances; none when the pairs do not tell.
Vector6 Solve(NormalEquations sums, bool is_upright) {
  if (is_upright) {
    sums.hessian.topRows<2>().setZero();
    sums.hessian.leftCols<2>().setZero();
    sums.gradient.head<2>().setZero();
  }
  sums.hessian.diagonal().array() += 1e-6 * static_cast<double>(sums.pair_count);
  const Vector6 step = -sums.hessian.ldlt().solve(sums.gradient);
  return step.allFinite() ? step : Vector6::Zero();
}

}  // namespace

Pose3d Align(const ModelIndex& model, const std::vector<Eigen::Vector3d>& points_map,
             const Pose3d& map_T_model, const AlignmentOptions& options) {
  Pose3d model_T_map = map_T_model.Inverse();
  const Eigen::Vector3d pivot = model.box().center();
  const int count = options.iteration_count_max;
  double gate_m = options.gate_first_m;
  const double shrink =
      std::pow(options.gate_last_m / options.gate_first_m, 1.0 / std::max(1, count / 2));
  for (int i = 0; i < count; ++i) {
    const NormalEquations sums = Collect(model, points_map, model_T_map, pivot, gate_m, options);
    if (sums.pair_count < kPairCountMin) break;
    const Vector6 step = Solve(sums, options.is_upright);
    const Eigen::Vector3d turn = step.head<3>();
    const double angle = turn.norm();
    Pose3d change;
    if (angle > 0.0) {
      change.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
    }
    change.position = pivot - change.orientation * pivot + step.tail<3>();
    model_T_map = change * model_T_map;
    model_T_map.orientation.normalize();
    if (gate_m <= options.gate_last_m && angle + step.tail<3>().norm() < kStepMinM) break;
    gate_m = std::max(options.gate_last_m, gate_m * shrink);
  }
  return model_T_map.Inverse();
}

Explanation Explain(const ModelIndex& model, const std::vector<Eigen::Vector3d>& points_map,
                    const Pose3d& map_T_model, double bound_m, bool is_exact) {
  const Pose3d model_T_map = map_T_model.Inverse();
  std::vector<bool> is_covered(static_cast<size_t>(model.patch_count()), false);
  size_t inlier_count = 0;
  double squared_sum = 0.0;
  for (const Eigen::Vector3d& point_map : points_map) {
    const Eigen::Vector3d point = model_T_map * point_map;
    const int nearest = NearestOf(model, point, is_exact);
    if (nearest < 0) continue;
    const double squared =
        (point - model.surface().points[static_cast<size_t>(nearest)]).squaredNorm();
    if (squared >= bound_m * bound_m) continue;
    ++inlier_count;
    squared_sum += squared;
    is_covered[static_cast<size_t>(model.patch(nearest))] = true;
  }
  Explanation out;
  if (inlier_count == 0) return out;
  const auto point_count = static_cast<double>(points_map.size());
  const auto inliers = static_cast<double>(inlier_count);
  out.inlier_share = inliers / point_count;
  out.residual_m = std::sqrt(squared_sum / inliers);
  out.cost = (squared_sum / (bound_m * bound_m) + point_count - inliers) / point_count;
  out.covered_share = static_cast<double>(std::count(is_covered.begin(), is_covered.end(), true)) /
                      static_cast<double>(model.patch_count());
  return out;
}

}  // namespace dsg::ingest
