// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/perspective.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/agents/detections/lens.h"
#include "ingest/agents/detections/pnp.h"
#include "ingest/agents/detections/torso_axes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Beyond, joints or calibration are wrong.
constexpr double kPersonDepthMinM = 0.1;
constexpr double kPersonDepthMaxM = 200.0;

double FocalPx(const CameraCalibration& camera) { return std::sqrt(camera.fx * camera.fy); }

absl::Status Bad(const HumanDetection& detection, const std::string& message) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("detection ", detection.id, " at ", detection.time_ns, " in ",
                                detection.camera, " ", message),
                   {{"detection", absl::StrCat(detection.id)}});
}

std::vector<SeenJoint> SeenJoints(const HumanDetection& detection, const CameraCalibration& camera,
                                  double visibility_min) {
  std::vector<SeenJoint> seen;
  if (!detection.has_joints) return seen;
  for (size_t j = 0; j < size_t{kJointCount}; ++j) {
    const double visibility = detection.joint_visibility[j];
    if (!(visibility >= visibility_min) || !detection.joints_root[j].allFinite()) continue;
    const std::optional<Eigen::Vector3d> ray = RayThrough(camera, detection.joints_px[j]);
    if (!ray.has_value()) continue;
    seen.push_back({detection.joints_root[j], ray->head<2>(), visibility});
  }
  return seen;
}

// A standing body of the mean height fills the box.
std::optional<Eigen::Vector3d> PlaceByBox(const HumanDetection& detection,
                                          const CameraCalibration& camera,
                                          const PlacementOptions& options) {
  const Eigen::Vector4d& box = detection.box_px;
  const double height_px = box[3] - box[1];
  if (!box.allFinite() || !(height_px > 1.0)) return std::nullopt;
  const std::optional<Eigen::Vector3d> ray =
      RayThrough(camera, {0.5 * (box[0] + box[2]), box[3] - options.pelvis_share * height_px});
  const std::optional<Eigen::Vector3d> top = RayThrough(camera, {0.5 * (box[0] + box[2]), box[1]});
  const std::optional<Eigen::Vector3d> bottom =
      RayThrough(camera, {0.5 * (box[0] + box[2]), box[3]});
  if (!ray.has_value() || !top.has_value() || !bottom.has_value()) return std::nullopt;
  const double slope = bottom->y() - top->y();
  if (!(slope > 1e-6)) return std::nullopt;
  return *ray * (options.body_height_m / slope);
}

Eigen::Matrix3d AlongRay(const Eigen::Vector3d& at, double sigma_ray_m, double sigma_lateral_m) {
  const Eigen::Vector3d ray = at.normalized();
  const Eigen::Matrix3d along = ray * ray.transpose();
  return sigma_ray_m * sigma_ray_m * along +
         sigma_lateral_m * sigma_lateral_m * (Eigen::Matrix3d::Identity() - along);
}

// By the joints' pixels; the turn and the pixel error are only theirs.
std::optional<BodyPlacement> PlaceByJoints(const std::vector<SeenJoint>& seen, double focal_px,
                                           const PlacementOptions& options) {
  std::optional<BodyPlacement> placement = PlaceByTranslation(seen, focal_px, options);
  if (placement.has_value() && placement->reprojection_px > options.good_px) {
    const auto refined = RefineSixDof(seen, focal_px, *placement, options.turn_rad_max);
    if (refined.has_value()) placement = refined;
  }
  return placement;
}

struct Placement {
  BodyPlacement body;
  bool is_by_box = false;
};

absl::StatusOr<Placement> Place(const HumanDetection& detection, const CameraCalibration& camera,
                                const PlacementOptions& options) {
  const double focal_px = FocalPx(camera);
  const std::vector<SeenJoint> seen = SeenJoints(detection, camera, options.fit_visibility_min);
  Placement placement;
  BodyPlacement& body = placement.body;
  body.covariance.setZero();
  if (detection.pelvis_camera.has_value()) {
    body.root_camera = *detection.pelvis_camera;
  } else if (const auto by_joints = PlaceByJoints(seen, focal_px, options)) {
    body = *by_joints;
  } else if (const auto by_weak = PlaceByWeakCamera(detection, camera)) {
    body.root_camera = *by_weak;
  } else if (const auto by_box = PlaceByBox(detection, camera, options)) {
    body.root_camera = *by_box;
    placement.is_by_box = true;
  } else {
    return Bad(detection,
               "has nothing to place the person by: neither four seen joints nor a "
               "weak camera, a pelvis or a box; leave it out");
  }
  const double depth_m = body.root_camera.z();
  if (!body.root_camera.allFinite() ||
      !(depth_m >= kPersonDepthMinM && depth_m <= kPersonDepthMaxM)) {
    return Bad(detection,
               absl::StrCat("puts the person at a depth of ", depth_m, " m; ", kPersonDepthMinM,
                            " to ", kPersonDepthMaxM,
                            " m before the camera is due; check joints and calibration"));
  }
  if (!body.covariance.allFinite()) return Bad(detection, "has joints beyond all bounds");
  const double reprojection_px = ReprojectionPx(seen, focal_px, body.root_camera, body.turn);
  body.reprojection_px = std::isfinite(reprojection_px) ? reprojection_px : 0.0;
  return placement;
}

}  // namespace

std::optional<Eigen::Vector3d> PlaceByWeakCamera(const HumanDetection& detection,
                                                 const CameraCalibration& camera) {
  const double scale_px = detection.weak_scale * detection.crop_px;
  if (!(scale_px > 0.0) || !std::isfinite(scale_px)) return std::nullopt;
  const double depth_m = 2.0 * FocalPx(camera) / scale_px;
  const std::optional<Eigen::Vector3d> ray =
      RayThrough(camera, detection.crop_center_px + 0.5 * scale_px * detection.weak_translation);
  if (!ray.has_value() || !(depth_m >= kPersonDepthMinM && depth_m <= kPersonDepthMaxM)) {
    return std::nullopt;
  }
  return *ray * depth_m;
}

absl::StatusOr<PersonInCamera> PlaceInCamera(const HumanDetection& detection,
                                             const CameraCalibration& camera,
                                             const PlacementOptions& options) {
  DSG_ASSIGN_OR_RETURN(const Placement placement, Place(detection, camera, options));
  const BodyPlacement& body = placement.body;
  PersonInCamera person;
  person.camera_T_torso.position = body.root_camera;
  person.joints_turn = body.turn;
  const double depth_m = body.root_camera.z();
  const double ray_m = placement.is_by_box ? options.box_ray_share * depth_m + options.box_ray_m
                                           : options.ray_share * depth_m + options.ray_m;
  const double hidden_m = options.hidden_lateral_m * (1.0 - MeanVisibility(detection));
  const double lateral_m =
      std::hypot(options.lateral_share * depth_m + options.lateral_m, hidden_m);
  person.covariance_camera = body.covariance + AlongRay(body.root_camera, ray_m, lateral_m);
  person.reprojection_px = body.reprojection_px;
  const std::optional<TorsoAxes> axes = FindTorsoAxes(detection, options);
  person.has_heading = axes.has_value();
  person.heading_sigma_rad = axes.has_value() ? axes->heading_sigma_rad : kNoHeadingSigmaRad;
  if (axes.has_value()) person.camera_T_torso.orientation = body.turn * axes->camera_R_torso;
  return person;
}

}  // namespace dsg::ingest
