// SPDX-License-Identifier: Apache-2.0
// Points of the world as two cameras see them, with noise and outliers, and the true motion.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "ingest/odometry/frontend/relative_pose.h"
#include "ingest/odometry/frontend/stereo_pose.h"
#include "schema/base/random.h"

namespace dsg::ingest {

/// Of uHumans1: 720 x 480, two of them 0.1 m apart.
inline CameraCalibration SceneCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.fx = camera.fy = 415.692;
  camera.cx = 360.0;
  camera.cy = 240.0;
  return camera;
}
inline constexpr double kSceneBaselineM = 0.1;

inline Pose3d MotionOf(const Eigen::Vector3d& position, const Eigen::Vector3d& axis_angle_deg) {
  const double angle = axis_angle_deg.norm() * M_PI / 180.0;
  Pose3d pose;
  pose.position = position;
  if (angle > 0.0) {
    pose.orientation = Eigen::AngleAxisd(angle, axis_angle_deg.normalized());
  }
  return pose;
}

struct SceneSpec {
  int count = 200;
  double outlier_share = 0.0;
  /// Standard deviations of pixels and of disparities.
  double noise_px = 0.3;
  double disparity_noise_px = 0.5;
  /// All points are on one plane, which looks aside; else they are 1 to 8 m away.
  bool is_plane = false;
  Pose3d first_T_second = MotionOf({0.2, 0.05, 0.1}, {1.0, -3.0, 2.0});
  uint64_t seed = 1;
};

struct MadeScene {
  Pose3d first_T_second;
  std::vector<BearingPair> bearings;
  std::vector<StereoPointPair> points;
  std::vector<bool> is_outlier;
};

/// A pixel and a disparity.
struct Sighting {
  Eigen::Vector2d pixel;
  double disparity_px;
};

inline std::optional<Sighting> SightingOf(const Eigen::Vector3d& point) {
  const CameraCalibration camera = SceneCamera();
  if (point.z() < 0.3) return std::nullopt;
  const Eigen::Vector2d pixel = Project(camera, point);
  if (pixel.minCoeff() < 0.0 || pixel.x() > camera.width - 1 || pixel.y() > camera.height - 1) {
    return std::nullopt;
  }
  return Sighting{pixel, camera.fx * kSceneBaselineM / point.z()};
}

inline Eigen::Vector3d BearingOf(const Eigen::Vector2d& pixel) {
  const CameraCalibration camera = SceneCamera();
  return Eigen::Vector3d((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy,
                         1.0)
      .normalized();
}

/// Anywhere in the image, 1 to 8 m away or on the plane.
inline Eigen::Vector3d ScenePoint(const SceneSpec& spec, Random* random) {
  const CameraCalibration camera = SceneCamera();
  const Eigen::Vector3d bearing = BearingOf(
      {random->Uniform(0.0, camera.width - 1.0), random->Uniform(0.0, camera.height - 1.0)});
  if (!spec.is_plane) return bearing * (random->Uniform(1.0, 8.0) / bearing.z());
  const Eigen::Vector3d normal = Eigen::Vector3d(0.5, 0.2, 1.0).normalized();
  return bearing * (3.0 / normal.dot(bearing));
}

inline MadeScene MakeScene(const SceneSpec& spec) {
  Random random(spec.seed, 7);
  const CameraCalibration camera = SceneCamera();
  RelativePoseOptions options;
  options.pixel_sigma_px = std::max(spec.noise_px, 0.01);
  options.disparity_sigma_px = std::max(spec.disparity_noise_px, 0.01);
  MadeScene scene;
  scene.first_T_second = spec.first_T_second;
  const auto noisy = [&](Sighting sighting) {
    sighting.pixel += spec.noise_px * Eigen::Vector2d(random.Normal(), random.Normal());
    sighting.disparity_px += spec.disparity_noise_px * random.Normal();
    sighting.disparity_px = std::max(sighting.disparity_px, 0.5);
    return sighting;
  };
  const auto stereo = [&](const Sighting& sighting) {
    return StereoPointOf(camera, kSceneBaselineM, sighting.pixel, sighting.disparity_px, options);
  };
  while (static_cast<int>(scene.bearings.size()) < spec.count) {
    const Eigen::Vector3d point = ScenePoint(spec, &random);
    const auto before = SightingOf(point);
    auto after = SightingOf(spec.first_T_second.Inverse() * point);
    const bool is_outlier =
        static_cast<double>(scene.bearings.size()) < spec.outlier_share * spec.count;
    // Some other point of the scene.
    if (is_outlier) after = SightingOf(ScenePoint(spec, &random));
    if (!before || !after) continue;
    const Sighting first = noisy(*before);
    const Sighting second = noisy(*after);
    scene.bearings.push_back({BearingOf(first.pixel), BearingOf(second.pixel)});
    scene.points.push_back({stereo(first), stereo(second)});
    scene.is_outlier.push_back(is_outlier);
  }
  return scene;
}

/// Of the inliers that were found: the share that is right, and of all right points the share that
/// was found.
struct InlierShares {
  double precision = 0.0;
  double recall = 0.0;
};

inline InlierShares SharesOf(const std::vector<int>& inliers, const MadeScene& scene) {
  double right = 0.0;
  double all_right = 0.0;
  for (const int i : inliers) right += scene.is_outlier[static_cast<size_t>(i)] ? 0.0 : 1.0;
  for (const bool is_outlier : scene.is_outlier) all_right += is_outlier ? 0.0 : 1.0;
  return {inliers.empty() ? 0.0 : right / static_cast<double>(inliers.size()), right / all_right};
}

inline double DegreesApart(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / M_PI;
}

inline double DegreesApart(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return AngleBetween(a, b) * 180.0 / M_PI;
}

}  // namespace dsg::ingest
