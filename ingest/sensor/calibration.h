// SPDX-License-Identifier: Apache-2.0
// What a sensor rig measures with: cameras, an inertial unit, and where they sit on the body.
// Refuses to read files; the readers of ingest/log do.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// kRadialTangential: k1 k2 p1 p2 [k3]; kEquidistant: k1 k2 k3 k4 (Kannala and Brandt, 2006).
enum class Distortion { kNone, kRadialTangential, kEquidistant };

/// A pinhole camera. Pixel centres are at whole numbers, x to the right, y down, z forward.
struct CameraCalibration {
  /// The channel it belongs to: "cam0", "depth0".
  std::string name;
  int width = 0;
  int height = 0;
  /// 0 = unknown.
  double rate_hz = 0.0;
  /// Focal lengths and principal point, pixels.
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  Distortion distortion = Distortion::kNone;
  std::vector<double> distortion_coefficients;
  Pose3d body_T_camera;

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming camera, field, value and bound.
  absl::Status Validate() const;
};

/// Noise densities are those of a continuous white noise and of a random walk.
struct ImuCalibration {
  std::string name;
  double rate_hz = 0.0;
  /// rad/s/sqrt(Hz).
  double gyro_noise_density = 0.0;
  /// rad/s^2/sqrt(Hz).
  double gyro_random_walk = 0.0;
  /// m/s^2/sqrt(Hz).
  double accel_noise_density = 0.0;
  /// m/s^3/sqrt(Hz).
  double accel_random_walk = 0.0;
  Pose3d body_T_imu;

  absl::Status Validate() const;
};

/// A scanner of any number of beams.
struct LidarCalibration {
  /// The channel it belongs to: "lidar0".
  std::string name;
  /// Lidar: x forward, y left, z up (REP 103).
  Pose3d body_T_lidar;

  absl::Status Validate() const;
};

struct RigCalibration {
  /// Ascending by name; names differ.
  std::vector<CameraCalibration> cameras;
  std::optional<ImuCalibration> imu;
  std::optional<LidarCalibration> lidar;

  /// Whether anything of it measures distances or can: a camera or a lidar.
  bool HasEyes() const { return !cameras.empty() || lidar.has_value(); }
  /// Null when there is none of that name.
  const CameraCalibration* FindCamera(std::string_view name) const;
};

/// Pixel of a point in the camera's frame, distortion applied. Requires: z > 0.
Eigen::Vector2d Project(const CameraCalibration& camera, const Eigen::Vector3d& point_camera);

}  // namespace dsg::ingest
