// SPDX-License-Identifier: Apache-2.0
// A room with painted walls that a stereo rig with an inertial unit is carried through, for tests.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/odometry/estimator/seen_features.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/pinhole.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/frontend/made_images.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"

namespace dsg::ingest {

/// The inside of a box of 7 x 6 x 3 m around the origin, seen by ideal cameras.
class TexturedRoom {
 public:
  TexturedRoom() {
    for (int v = 0; v < kSide; ++v) {
      for (int u = 0; u < kSide; ++u) {
        texture_.push_back(static_cast<float>(WaveTexture(u * 0.09, v * 0.09)));
      }
    }
  }

  /// What a depth camera measures, to the millimetre.
  Image Depth(const CameraCalibration& camera, const Pose3d& map_T_camera) const {
    Image depth{camera.width, camera.height, PixelFormat::kDepth16, {}};
    depth.bytes.resize(depth.Offset(0, camera.height));
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector3d ray = map_T_camera.orientation * PinholeRay(camera, u, v);
        const auto depth_mm =
            static_cast<uint16_t>(std::lround(1e3 * HitAlong(map_T_camera.position, ray).along));
        depth.bytes[depth.Offset(u, v)] = static_cast<uint8_t>(depth_mm & 0xff);
        depth.bytes[depth.Offset(u, v) + 1] = static_cast<uint8_t>(depth_mm >> 8);
      }
    }
    return depth;
  }

  Image Seen(const CameraCalibration& camera, const Pose3d& map_T_camera) const {
    return PaintedImage(camera.width, camera.height, [&](int u, int v) {
      return GrayAlong(map_T_camera.position, map_T_camera.orientation * PinholeRay(camera, u, v));
    });
  }

 private:
  static constexpr int kSide = 2048;

  // Where a ray meets a wall: so many times its length.
  struct Hit {
    double along = 1e9;
    int wall = 0;
  };

  static Hit HitAlong(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
    const Eigen::Vector3d half(3.5, 3.0, 1.5);
    Hit hit;
    for (int axis = 0; axis < 3; ++axis) {
      if (ray[axis] == 0.0) continue;
      const double side = ray[axis] > 0.0 ? half[axis] : -half[axis];
      const double along = (side - from[axis]) / ray[axis];
      if (along < hit.along) hit = {along, 2 * axis + (ray[axis] > 0.0 ? 1 : 0)};
    }
    return hit;
  }

  // Walls have other places of one texture, a texel a centimetre.
  double GrayAlong(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) const {
    const Hit hit = HitAlong(from, ray);
    const Eigen::Vector3d at = from + hit.along * ray;
    const int axis = hit.wall / 2;
    const double x = 100.0 * (at[(axis + 1) % 3] + 4.0) + 131.0 * hit.wall;
    const double y = 100.0 * (at[(axis + 2) % 3] + 4.0) + 97.0 * hit.wall;
    return Texel(std::clamp(x, 0.0, kSide - 2.0), std::clamp(y, 0.0, kSide - 2.0));
  }

  double Texel(double x, double y) const {
    const int u = static_cast<int>(x);
    const int v = static_cast<int>(y);
    const double a = x - u;
    const double b = y - v;
    const auto at = [&](int du, int dv) {
      return static_cast<double>(texture_[static_cast<size_t>((v + dv) * kSide + u + du)]);
    };
    return (1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) + b * ((1 - a) * at(0, 1) + a * at(1, 1));
  }

  std::vector<float> texture_;
};

/// How the unit is carried: at rest until `rest_s`, then swung with up to 0.7 m/s.
struct Carried {
  double rest_s = 1.5;

  Pose3d At(double t) const {
    const double s = std::max(0.0, t - rest_s);
    // The motion sets in smoothly.
    const double gain = s * s / (0.5 + s * s);
    const Eigen::Vector3d turn(0.1 * std::sin(0.9 * s), 0.1 * std::sin(0.7 * s),
                               0.6 * std::sin(0.5 * s));
    return {gain * Eigen::Vector3d(1.0 * std::sin(0.6 * s), 0.8 * std::sin(0.45 * s),
                                   0.2 * std::sin(1.1 * s)),
            RotationOf(gain * turn)};
  }
  Eigen::Vector3d VelocityAt(double t) const {
    constexpr double kStep = 1e-4;
    return (At(t + kStep).position - At(t - kStep).position) / (2.0 * kStep);
  }
  ImuMeasurement Measured(double t) const {
    constexpr double kStep = 1e-4;
    const Eigen::Vector3d rate =
        RotationVectorOf(At(t - kStep).orientation.conjugate() * At(t + kStep).orientation) /
        (2.0 * kStep);
    const Eigen::Vector3d acceleration =
        (VelocityAt(t + kStep) - VelocityAt(t - kStep)) / (2.0 * kStep);
    return {std::llround(1e9 * t), rate,
            At(t).orientation.conjugate() * (acceleration + Eigen::Vector3d(0.0, 0.0, 9.81))};
  }
};

/// Two cameras that look along the unit's x axis, 0.12 m apart.
struct RoomRig {
  CameraCalibration left = ImageCamera();
  double baseline_m = 0.12;
  ImuCalibration imu = Adis16448();

  RoomRig() {
    Eigen::Matrix3d imu_R_camera;
    imu_R_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    left.body_T_camera = {{0.1, 0.06, 0.0}, Eigen::Quaterniond(imu_R_camera)};
    imu.accel_random_walk = 1e-3;
  }
  CameraCalibration right() const {
    CameraCalibration camera = left;
    camera.name = "cam1";
    camera.body_T_camera.position +=
        left.body_T_camera.orientation * Eigen::Vector3d(baseline_m, 0.0, 0.0);
    return camera;
  }
};

}  // namespace dsg::ingest
