// SPDX-License-Identifier: Apache-2.0
// Cameras and places to look from, for tests of what is rendered.
// Refuses to render.
#pragma once

#include <cmath>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

/// 720 x 480, the rig of the reference data.
inline ingest::CameraCalibration ReferenceCamera() {
  ingest::CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.fx = camera.fy = 415.692;
  camera.cx = 360.0;
  camera.cy = 240.0;
  return camera;
}

/// Looks along `yaw` from x to the left, up by `pitch`; the image is upright.
inline Pose3d LookFrom(const Eigen::Vector3d& eye, double yaw, double pitch = 0.0) {
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                                std::sin(pitch));
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  Eigen::Matrix3d axes;
  axes << right, forward.cross(right), forward;
  return {eye, Eigen::Quaterniond(axes).normalized()};
}

/// About `count` views from places all over the world, at a robot's height, all around.
inline std::vector<Pose3d> TourViews(const World& world, int count) {
  std::vector<Pose3d> views;
  const int place_count = static_cast<int>(world.places.places.size());
  for (int i = 0; i < count; ++i) {
    const Place& place = world.places.places[static_cast<size_t>(i) * place_count / count];
    const double yaw = 2.4 * i;
    const double pitch = 0.2 * std::sin(1.7 * i);
    views.push_back(LookFrom({place.position.x(), place.position.y(), 1.2}, yaw, pitch));
  }
  return views;
}

}  // namespace dsg::simulator
