// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/lens.h"

#include <Eigen/LU>
#include <cmath>

namespace dsg::ingest {
namespace {

constexpr int kNewtonStepCount = 30;
constexpr double kDoneJustPx = 1e-6;
constexpr double kDonePx = 1e-3;
constexpr double kDifference = 1e-6;
// A longer step would leap over the fold of the distortion polynomial.
constexpr double kStepMax = 0.3;

Eigen::Vector2d PixelOf(const CameraCalibration& camera, const Eigen::Vector2d& ray) {
  return Project(camera, Eigen::Vector3d(ray.x(), ray.y(), 1.0));
}

Eigen::Matrix2d PixelPerRay(const CameraCalibration& camera, const Eigen::Vector2d& ray) {
  Eigen::Matrix2d jacobian;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kDifference * Eigen::Vector2d::Unit(axis);
    jacobian.col(axis) =
        (PixelOf(camera, ray + step) - PixelOf(camera, ray - step)) / (2.0 * kDifference);
  }
  return jacobian;
}

}  // namespace

std::optional<Eigen::Vector3d> RayThrough(const CameraCalibration& camera,
                                          const Eigen::Vector2d& pixel) {
  if (!pixel.allFinite()) return std::nullopt;
  Eigen::Vector2d ray((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  if (camera.distortion == Distortion::kNone) return Eigen::Vector3d(ray.x(), ray.y(), 1.0);
  Eigen::Matrix2d jacobian = PixelPerRay(camera, ray);
  for (int round = 0; round < kNewtonStepCount; ++round) {
    const Eigen::Vector2d left_px = pixel - PixelOf(camera, ray);
    if (left_px.norm() < kDoneJustPx) break;
    // Beyond the fold pixels run backwards, and one belongs to two rays.
    if (!(jacobian.determinant() > 0.0)) return std::nullopt;
    Eigen::Vector2d step = jacobian.inverse() * left_px;
    if (step.norm() > kStepMax) step *= kStepMax / step.norm();
    ray += step;
    jacobian = PixelPerRay(camera, ray);
  }
  const bool is_found = (pixel - PixelOf(camera, ray)).norm() < kDonePx;
  if (!is_found || !(jacobian.determinant() > 0.0)) return std::nullopt;
  return Eigen::Vector3d(ray.x(), ray.y(), 1.0);
}

}  // namespace dsg::ingest
