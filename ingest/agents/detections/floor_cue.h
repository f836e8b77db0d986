// SPDX-License-Identifier: Apache-2.0
// What the floor says of where a person stands: how far by the soles, how high by the skeleton.
// Refuses to look at other images than the detector's.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "ingest/agents/detections/cue_options.h"
#include "ingest/agents/person_observation.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A detection with what it says of the map's axes, and how it is read.
struct PlacedBody {
  const HumanDetection* detection = nullptr;
  const CameraCalibration* camera = nullptr;
  Pose3d map_T_camera;
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
  /// Minus the torso, axes of the map; meaningful if the detection has joints.
  std::array<Eigen::Vector3d, kJointCount> joints_map;
  /// 0 to 1; 1 without joints.
  double visibility = 1.0;
  FloorCueOptions floor_options;
  DepthCueOptions depth_options;
};

/// The distance at which the lowest seen pixel of the body meets the floor; nullopt when the feet
/// are hidden or cut off, or the camera does not look down at them. Knows the distance alone.
///
/// The box's bottom counts, not the pixels of the ankle joints: those share the error of the
/// detection's own depth when the network draws them from its 3D body.
std::optional<PositionCue> FloorContactCue(const PlacedBody& body, double floor_z_map);

/// When the feet are hidden: the distance at which the top of the head is as high above the floor
/// as the skeleton is tall. Knows the distance alone, and that worse. nullopt when the head is
/// hidden, cut off or about as high as the camera.
std::optional<PositionCue> HeadTopCue(const PlacedBody& body, double floor_z_map);

/// Of the pelvis above the floor, by the skeleton's own legs, bent or not; without joints
/// `standing_m` +- `sigma_m`. Knows the height alone.
PositionCue TorsoHeightCue(const PlacedBody& body, double floor_z_map, double standing_m,
                           double sigma_m);

/// Unit, horizontal, from the camera to `point_map`; nullopt when they stand above each other.
std::optional<Eigen::Vector3d> HorizontalView(const Eigen::Vector3d& camera_map,
                                              const Eigen::Vector3d& point_map);

}  // namespace dsg::ingest
