// SPDX-License-Identifier: Apache-2.0
// Landmarks on made surfaces, as a camera sees them, for tests of the mesher.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <vector>

#include "ingest/odometry/window/seen_landmark.h"
#include "ingest/sensor/pinhole.h"
#include "schema/base/random.h"
#include "schema/model/geometry.h"
#include "tests/unit/ingest/odometry/frontend/made_images.h"

namespace dsg::ingest {

inline CameraCalibration MeshCamera() { return ImageCamera(752, 480); }

/// Of a camera that looks along the odometry frame's x axis.
inline Pose3d LookingAlongX(const Eigen::Vector3d& position = Eigen::Vector3d::Zero()) {
  Eigen::Matrix3d odom_R_camera;
  odom_R_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {position, Eigen::Quaterniond(odom_R_camera)};
}

/// Where a ray from a place meets the scene first, in lengths of the ray; infinite if nowhere.
using Scene = std::function<double(const Eigen::Vector3d& from, const Eigen::Vector3d& ray)>;

/// The plane normal . p = offset.
inline Scene Plane(const Eigen::Vector3d& normal, double offset) {
  return [normal, offset](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
    const double along = (offset - normal.dot(from)) / normal.dot(ray);
    return along > 0.0 ? along : std::numeric_limits<double>::infinity();
  };
}

inline Scene Nearest(const Scene& a, const Scene& b) {
  return [a, b](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
    return std::min(a(from, ray), b(from, ray));
  };
}

/// A board across the x axis that reaches so far from it.
inline Scene Board(double x, double half_y, double half_z) {
  return [=](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
    const double along = (x - from.x()) / ray.x();
    const Eigen::Vector3d at = from + along * ray;
    const bool hits = along > 0.0 && std::abs(at.y()) < half_y && std::abs(at.z()) < half_z;
    return hits ? along : std::numeric_limits<double>::infinity();
  };
}

/// A landmark at a pixel, seen from three keyframes.
inline SeenLandmark LandmarkAt(int64_t id, const Scene& scene, const CameraCalibration& camera,
                               const Pose3d& odom_T_camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d ray = odom_T_camera.orientation * PinholeRay(camera, pixel.x(), pixel.y());
  return {id, odom_T_camera.position + scene(odom_T_camera.position, ray) * ray, pixel, 3};
}

/// So many at random pixels, with ascending ids from `first_id`.
inline std::vector<SeenLandmark> LandmarksOn(const Scene& scene, const CameraCalibration& camera,
                                             const Pose3d& odom_T_camera, int count,
                                             int64_t first_id = 0) {
  Random random(11, static_cast<uint64_t>(first_id));
  std::vector<SeenLandmark> landmarks;
  for (int i = 0; i < count; ++i) {
    const double column = random.Uniform(0.0, camera.width - 1.0);
    const double row = random.Uniform(0.0, camera.height - 1.0);
    landmarks.push_back(LandmarkAt(first_id + i, scene, camera, odom_T_camera, {column, row}));
  }
  return landmarks;
}

inline std::map<int64_t, SeenLandmark> ById(const std::vector<SeenLandmark>& landmarks) {
  std::map<int64_t, SeenLandmark> by_id;
  for (const SeenLandmark& landmark : landmarks) by_id[landmark.feature_id] = landmark;
  return by_id;
}

}  // namespace dsg::ingest
