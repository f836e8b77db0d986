// SPDX-License-Identifier: Apache-2.0
// From a detector's crop camera to the full camera: where the person is before the camera.
// Refuses to know the map.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "absl/status/statusor.h"
#include "ingest/agents/detections/cue_options.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Of a heading that nothing tells, radians.
inline constexpr double kNoHeadingSigmaRad = 3.0;

/// Where a detection puts its torso, camera frame.
struct PersonInCamera {
  Pose3d camera_T_torso;
  /// How fitting the pixels turned the joints about the pelvis, axes of the camera; included in
  /// camera_T_torso.
  Eigen::Quaterniond joints_turn = Eigen::Quaterniond::Identity();
  /// Of the position, metres^2: long along the ray.
  Eigen::Matrix3d covariance_camera = Eigen::Matrix3d::Identity();
  bool has_heading = false;
  double heading_sigma_rad = 0.35;
  /// Root mean square of the joints' reprojection, pixels; 0 without joints.
  double reprojection_px = 0.0;
};

/// Translation by linear PnP over the visible joints (IRLS with Huber's weights), refined in six
/// degrees of freedom (OpenCV) when it reprojects badly; from the box alone, by the height of a
/// mean body, when there are no joints; taken as it is when the detector gives a full translation.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the detection when it puts the person behind
/// the camera, or has nothing to place it by.
/// Source: RSS 2020, section IV-A "Human Nodes"; Zheng et al. 2013 (PnP).
absl::StatusOr<PersonInCamera> PlaceInCamera(const HumanDetection& detection,
                                             const CameraCalibration& camera,
                                             const PlacementOptions& options);

/// The pelvis by the weak camera alone: depth 2 f / (scale * crop), on the ray of its centre;
/// nullopt when the detection has none, or it lies at no sensible depth.
std::optional<Eigen::Vector3d> PlaceByWeakCamera(const HumanDetection& detection,
                                                 const CameraCalibration& camera);

}  // namespace dsg::ingest
