// SPDX-License-Identifier: Apache-2.0
// Places made of points that have descriptors, and what cameras see of them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "ingest/recognition/keyframe_features.h"
#include "schema/base/random.h"

namespace dsg::ingest {

inline CameraCalibration PlaceCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.fx = camera.fy = 415.692;
  camera.cx = 360.0;
  camera.cy = 240.0;
  return camera;
}

inline OrbDescriptor RandomDescriptor(Random* random) {
  OrbDescriptor descriptor;
  for (uint8_t& byte : descriptor) byte = static_cast<uint8_t>(random->Index(256));
  return descriptor;
}

/// The same corner from elsewhere: each bit is turned with a chance.
inline OrbDescriptor SeenAgain(OrbDescriptor descriptor, double chance, Random* random) {
  for (uint8_t& byte : descriptor) {
    for (int bit = 0; bit < 8; ++bit) {
      if (random->Chance(chance)) byte = static_cast<uint8_t>(byte ^ (1 << bit));
    }
  }
  return descriptor;
}

struct MadePlace {
  std::vector<Eigen::Vector3d> points;
  std::vector<OrbDescriptor> descriptors;
};

/// Points 1.5 to 6 m before a camera at the origin, over all of its image.
inline MadePlace MakePlace(uint64_t seed, int count = 300) {
  Random random(seed, 11);
  const CameraCalibration camera = PlaceCamera();
  MadePlace place;
  for (int i = 0; i < count; ++i) {
    const double depth_m = random.Uniform(1.5, 6.0);
    const double u = random.Uniform(0.0, camera.width - 1.0);
    const double v = random.Uniform(0.0, camera.height - 1.0);
    place.points.emplace_back(depth_m * (u - camera.cx) / camera.fx,
                              depth_m * (v - camera.cy) / camera.fy, depth_m);
    place.descriptors.push_back(RandomDescriptor(&random));
  }
  return place;
}

struct ViewSpec {
  KeyframeStamp stamp;
  /// Of the camera in the frame of the place.
  Pose3d place_T_camera;
  Pose3d body_T_camera;
  bool has_depth = true;
  double noise_px = 0.5;
  /// Of depths: metres for each square metre of depth.
  double depth_noise = 0.01;
  /// Of each bit, that it differs from the place's.
  double bit_chance = 0.08;
  /// Features at some other pixel, which look like those of the place.
  double moved_share = 0.0;
  /// Features of nothing in the place.
  int other_count = 100;
  uint64_t seed = 1;
};

inline KeyframeFeatures MadeKeyframe(const MadePlace& place, const ViewSpec& spec) {
  Random random(spec.seed, 12);
  KeyframeFeatures keyframe;
  keyframe.stamp = spec.stamp;
  keyframe.camera = PlaceCamera();
  keyframe.camera.body_T_camera = spec.body_T_camera;
  const CameraCalibration& camera = keyframe.camera;
  const auto add = [&](const Eigen::Vector2d& pixel, double depth_m,
                       const OrbDescriptor& descriptor) {
    KeyframeFeature feature;
    feature.pixel = pixel.cast<float>();
    feature.pixel_sigma_px = static_cast<float>(spec.noise_px);
    const double sigma_m = spec.depth_noise * depth_m * depth_m;
    if (spec.has_depth) {
      feature.depth_m = static_cast<float>(depth_m + sigma_m * random.Normal());
      feature.depth_sigma_m = static_cast<float>(sigma_m);
    }
    keyframe.features.push_back(feature);
    keyframe.descriptors.push_back(descriptor);
  };
  const auto anywhere = [&] {
    return Eigen::Vector2d(random.Uniform(0.0, camera.width - 1.0),
                           random.Uniform(0.0, camera.height - 1.0));
  };
  for (size_t i = 0; i < place.points.size(); ++i) {
    const Eigen::Vector3d point = spec.place_T_camera.Inverse() * place.points[i];
    if (point.z() < 0.3) continue;
    Eigen::Vector2d pixel = Project(camera, point);
    pixel += spec.noise_px * Eigen::Vector2d(random.Normal(), random.Normal());
    if (random.Chance(spec.moved_share)) pixel = anywhere();
    if (pixel.minCoeff() < 0.0 || pixel.x() > camera.width - 1 || pixel.y() > camera.height - 1) {
      continue;
    }
    add(pixel, point.z(), SeenAgain(place.descriptors[i], spec.bit_chance, &random));
  }
  for (int i = 0; i < spec.other_count; ++i) {
    add(anywhere(), random.Uniform(1.0, 6.0), RandomDescriptor(&random));
  }
  return keyframe;
}

inline Pose3d PoseAt(const Eigen::Vector3d& position, const Eigen::Vector3d& axis_angle_deg) {
  const double angle = axis_angle_deg.norm() * M_PI / 180.0;
  Pose3d pose;
  pose.position = position;
  if (angle > 0.0) pose.orientation = Eigen::AngleAxisd(angle, axis_angle_deg.normalized());
  return pose;
}

inline double DegreesOfTurn(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return AngleBetween(a, b) * 180.0 / M_PI;
}

}  // namespace dsg::ingest
