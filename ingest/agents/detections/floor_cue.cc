// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/floor_cue.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ingest/agents/detections/lens.h"

namespace dsg::ingest {
namespace {

// SMPL's order. The ankles alone do not do: a doorstep hides the soles and makes metres of it.
constexpr std::array<size_t, 2> kFootJoints = {10, 11};
constexpr size_t kHead = 15;

bool FeetAreSeen(const HumanDetection& detection, const FloorCueOptions& options) {
  if (!detection.has_joints) {
    const Eigen::Vector4d& box = detection.box_px;
    return box[3] - box[1] >= options.aspect_min * (box[2] - box[0]);
  }
  return std::any_of(kFootJoints.begin(), kFootJoints.end(), [&](size_t joint) {
    return detection.joint_visibility[joint] >= options.visibility_min;
  });
}

double ContactColumn(const HumanDetection& detection, double visibility_min) {
  const Eigen::Vector4d& box = detection.box_px;
  if (!detection.has_joints) return 0.5 * (box[0] + box[2]);
  double sum = 0.0;
  int count = 0;
  for (const size_t joint : kFootJoints) {
    if (detection.joint_visibility[joint] < visibility_min) continue;
    sum += detection.joints_px[joint].x();
    ++count;
  }
  return std::clamp(sum / std::max(count, 1), box[0], box[2]);
}

// The middle of each foot between ankle and ball: of two noisy joints each, so that the lower or
// nearer foot is not just the noisier joint.
std::array<Eigen::Vector3d, 2> Feet(const PlacedBody& body) {
  return {0.5 * (body.joints_map[7] + body.joints_map[10]),
          0.5 * (body.joints_map[8] + body.joints_map[11])};
}

// How far the nearest tip of a foot is from the pelvis, towards the camera negative.
double NearestTipM(const PlacedBody& body, const Eigen::Vector3d& view) {
  const double tip_m = body.floor_options.tip_m;
  if (!body.detection->has_joints) return -tip_m;
  const auto feet = Feet(body);
  return std::min(view.dot(feet[0]), view.dot(feet[1])) - tip_m;
}

// Of the pelvis above the soles; nullopt when no person's are so long.
std::optional<double> LegsM(const PlacedBody& body) {
  const FloorCueOptions& options = body.floor_options;
  const auto feet = Feet(body);
  const double legs_m = options.sole_m - std::min(feet[0].z(), feet[1].z());
  if (!(legs_m >= options.pelvis_m_min && legs_m <= options.pelvis_m_max)) return std::nullopt;
  return legs_m;
}

std::optional<Eigen::Vector3d> MapRay(const PlacedBody& body, const Eigen::Vector2d& pixel) {
  const auto ray = RayThrough(*body.camera, pixel);
  if (!ray.has_value()) return std::nullopt;
  return body.map_T_camera.orientation * *ray;
}

// Knows the horizontal distance along `view` alone.
std::optional<PositionCue> RangeCue(const PlacedBody& body, const Eigen::Vector3d& view,
                                    double range_m, double sigma_m) {
  if (!(range_m >= body.floor_options.range_m_min && range_m <= body.floor_options.range_m_max)) {
    return std::nullopt;
  }
  PositionCue cue;
  cue.kind = PositionCue::Kind::kFloorContact;
  cue.torso_map = body.map_T_camera.position + view * range_m;
  cue.torso_map.z() = body.torso_map.z();
  cue.information_map = view * view.transpose() / (sigma_m * sigma_m);
  return cue;
}

}  // namespace

std::optional<Eigen::Vector3d> HorizontalView(const Eigen::Vector3d& camera_map,
                                              const Eigen::Vector3d& point_map) {
  Eigen::Vector3d view = point_map - camera_map;
  view.z() = 0.0;
  if (!(view.norm() > 0.05)) return std::nullopt;
  return view.normalized();
}

std::optional<PositionCue> FloorContactCue(const PlacedBody& body, double floor_z_map) {
  const HumanDetection& detection = *body.detection;
  const FloorCueOptions& options = body.floor_options;
  const double bottom_px = detection.box_px[3];
  if (bottom_px >= body.camera->height - 1 - options.border_px ||
      !FeetAreSeen(detection, options)) {
    return std::nullopt;
  }
  const double above_m = body.map_T_camera.position.z() - floor_z_map;
  const auto ray = MapRay(body, {ContactColumn(detection, options.visibility_min), bottom_px});
  // Upwards, or so flat that a pixel more is metres.
  if (!ray.has_value() || !(above_m > options.camera_above_m) || !(ray->z() < -0.02))
    return std::nullopt;
  const double contact_m = above_m * ray->head<2>().norm() / -ray->z();
  const Eigen::Vector3d view = Eigen::Vector3d(ray->x(), ray->y(), 0.0).normalized();
  double sigma_m =
      contact_m * contact_m * options.contact_px / (body.camera->fy * above_m) + options.contact_m;
  sigma_m = std::hypot(sigma_m, options.legs_m + options.hidden_legs_m * (1.0 - body.visibility));
  if (!detection.has_joints) sigma_m *= options.box_factor;
  return RangeCue(body, view, contact_m - NearestTipM(body, view), sigma_m);
}

std::optional<PositionCue> HeadTopCue(const PlacedBody& body, double floor_z_map) {
  const HumanDetection& detection = *body.detection;
  const FloorCueOptions& options = body.floor_options;
  if (!detection.has_joints || detection.joint_visibility[kHead] < options.visibility_min ||
      detection.box_px[1] <= options.border_px) {
    return std::nullopt;
  }
  const auto ray = MapRay(body, {detection.joints_px[kHead].x(), detection.box_px[1]});
  const auto legs_m = LegsM(body);
  if (!ray.has_value() || !legs_m.has_value()) return std::nullopt;
  const double flat = ray->head<2>().norm();
  const Eigen::Vector3d& head = body.joints_map[kHead];
  const double top_m = *legs_m + head.z() + options.head_top_m;
  const double above_m = floor_z_map + top_m - body.map_T_camera.position.z();
  if (!(std::abs(above_m) > options.head_above_m) || !(ray->z() * above_m > 0.0) ||
      !(flat > 0.05)) {
    return std::nullopt;
  }
  const double head_m = above_m * flat / ray->z();
  const Eigen::Vector3d view = Eigen::Vector3d(ray->x(), ray->y(), 0.0).normalized();
  const double top_sigma_m = std::hypot(
      options.stature_m, options.skeleton_m + options.hidden_skeleton_m * (1.0 - body.visibility));
  const double sigma_m = head_m * top_sigma_m / std::abs(above_m);
  return RangeCue(body, view, head_m - view.dot(head), sigma_m);
}

PositionCue TorsoHeightCue(const PlacedBody& body, double floor_z_map, double standing_m,
                           double sigma_m) {
  double height_m = standing_m;
  if (body.detection->has_joints) {
    if (const auto legs_m = LegsM(body)) {
      height_m = *legs_m;
      sigma_m =
          std::min(sigma_m, body.floor_options.skeleton_m +
                                body.floor_options.hidden_skeleton_m * (1.0 - body.visibility));
    }
  }
  PositionCue cue;
  cue.kind = PositionCue::Kind::kTorsoHeight;
  cue.torso_map = {body.torso_map.x(), body.torso_map.y(), floor_z_map + height_m};
  cue.information_map(2, 2) = 1.0 / (sigma_m * sigma_m);
  return cue;
}

}  // namespace dsg::ingest
