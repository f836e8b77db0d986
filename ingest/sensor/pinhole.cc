// SPDX-License-Identifier: Apache-2.0
#include "ingest/sensor/pinhole.h"

#include <Eigen/LU>
#include <cmath>

namespace dsg::ingest {
namespace {

// No lens here looks further than 84 degrees off its axis.
constexpr double kRadiusLimit = 10.0;

// Radius in the image (focal length 1) of a ray at `radius`, tangential terms left out.
double BentRadius(const CameraCalibration& camera, double radius) {
  const std::vector<double>& k = camera.distortion_coefficients;
  if (camera.distortion == Distortion::kRadialTangential) {
    const double r2 = radius * radius;
    const double k3 = k.size() > 4 ? k[4] : 0.0;
    return radius * (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k3)));
  }
  const double angle = std::atan(radius);
  const double a2 = angle * angle;
  return angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
}

}  // namespace

double RadiusMax(const CameraCalibration& camera) {
  if (camera.distortion == Distortion::kNone) return kRadiusLimit;
  constexpr double kStep = 0.01;
  double last = 0.0;
  for (double radius = kStep; radius < kRadiusLimit; radius += kStep) {
    const double bent = BentRadius(camera, radius);
    if (bent <= last) return radius - kStep;
    last = bent;
  }
  return kRadiusLimit;
}

std::optional<Eigen::Vector3d> RayOf(const CameraCalibration& camera,
                                     const Eigen::Vector2d& pixel) {
  Eigen::Vector3d ray = PinholeRay(camera, pixel.x(), pixel.y());
  if (camera.distortion == Distortion::kNone) return ray;
  constexpr double kDelta = 1e-6;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d at = Project(camera, ray);
    const Eigen::Vector2d error_px = at - pixel;
    if (error_px.norm() < 1e-3) return ray;
    Eigen::Matrix2d jacobian;
    jacobian.col(0) = (Project(camera, ray + Eigen::Vector3d(kDelta, 0.0, 0.0)) - at) / kDelta;
    jacobian.col(1) = (Project(camera, ray + Eigen::Vector3d(0.0, kDelta, 0.0)) - at) / kDelta;
    if (std::abs(jacobian.determinant()) < 1e-6) return std::nullopt;
    ray.head<2>() -= jacobian.inverse() * error_px;
    if (!ray.allFinite() || ray.head<2>().norm() > kRadiusLimit) return std::nullopt;
  }
  return std::nullopt;
}

CameraCalibration WithoutDistortion(const CameraCalibration& camera) {
  CameraCalibration rectified = camera;
  rectified.distortion = Distortion::kNone;
  rectified.distortion_coefficients.clear();
  return rectified;
}

double CentreDistance(const CameraCalibration& a, const CameraCalibration& b) {
  return (a.body_T_camera.position - b.body_T_camera.position).norm();
}

}  // namespace dsg::ingest
