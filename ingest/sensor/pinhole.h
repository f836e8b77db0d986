// SPDX-License-Identifier: Apache-2.0
// Rays of a camera's pixels, and the pinhole that its images are rectified to.
// Refuses pixels whose ray the lens model cannot tell.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// Through the centre of a pixel, z = 1, camera frame. Requires: no distortion.
inline Eigen::Vector3d PinholeRay(const CameraCalibration& camera, double u, double v) {
  return {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0};
}

/// The same with distortion taken off; nullopt where no ray gives that pixel.
std::optional<Eigen::Vector3d> RayOf(const CameraCalibration& camera, const Eigen::Vector2d& pixel);

/// Further from the axis (x² + y² at z = 1, its root) the distortion polynomial folds back, so
/// that one pixel would belong to two rays.
double RadiusMax(const CameraCalibration& camera);

/// Size, focal lengths and pose of `camera`, without distortion.
CameraCalibration WithoutDistortion(const CameraCalibration& camera);

/// Distance of the centres, metres.
double CentreDistance(const CameraCalibration& a, const CameraCalibration& b);

}  // namespace dsg::ingest
