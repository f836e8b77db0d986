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
constexpr double kBorderPx = 3.0;
constexpr double kContactPx = 3.0;
constexpr double kContactM = 0.05;
// The network's legs are not the person's.
constexpr double kLegsM = 0.08;
constexpr double kHiddenLegsM = 0.25;
// From the middle of a foot to tip or heel, and down to the sole.
constexpr double kTipM = 0.08;
constexpr double kSoleBelowFootM = 0.055;
constexpr double kRangeMinM = 0.4;
constexpr double kRangeMaxM = 20.0;
// A box without joints is a whole standing body when it is tall.
constexpr double kStandingAspectMin = 2.0;
constexpr double kBoxOnlyFactor = 2.0;
constexpr double kTorsoHeightMinM = 0.15;
constexpr double kTorsoHeightMaxM = 1.3;
constexpr double kSkeletonHeightM = 0.05;
constexpr double kHiddenSkeletonHeightM = 0.2;
constexpr double kHeadJointToTopM = 0.17;
// Of adults; a network that has a body's size wrong has it wrong in its skeleton too.
constexpr double kStatureM = 0.08;
// At the height of the camera a head says nothing of its distance.
constexpr double kHeadAboveMinM = 0.2;

bool FeetAreSeen(const HumanDetection& detection) {
  if (!detection.has_joints) {
    const Eigen::Vector4d& box = detection.box_px;
    return box[3] - box[1] >= kStandingAspectMin * (box[2] - box[0]);
  }
  return std::any_of(kFootJoints.begin(), kFootJoints.end(), [&](size_t joint) {
    return detection.joint_visibility[joint] >= kJointVisibilityMin;
  });
}

double ContactColumn(const HumanDetection& detection) {
  const Eigen::Vector4d& box = detection.box_px;
  if (!detection.has_joints) return 0.5 * (box[0] + box[2]);
  double sum = 0.0;
  int count = 0;
  for (const size_t joint : kFootJoints) {
    if (detection.joint_visibility[joint] < kJointVisibilityMin) continue;
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
  if (!body.detection->has_joints) return -kTipM;
  const auto feet = Feet(body);
  return std::min(view.dot(feet[0]), view.dot(feet[1])) - kTipM;
}

// Of the pelvis above the soles; nullopt when no person's are so long.
std::optional<double> LegsM(const PlacedBody& body) {
  const auto feet = Feet(body);
  const double legs_m = kSoleBelowFootM - std::min(feet[0].z(), feet[1].z());
  if (!(legs_m >= kTorsoHeightMinM && legs_m <= kTorsoHeightMaxM)) return std::nullopt;
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
  if (!(range_m >= kRangeMinM && range_m <= kRangeMaxM)) return std::nullopt;
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
  const double bottom_px = detection.box_px[3];
  if (bottom_px >= body.camera->height - 1 - kBorderPx || !FeetAreSeen(detection)) {
    return std::nullopt;
  }
  const double above_m = body.map_T_camera.position.z() - floor_z_map;
  const auto ray = MapRay(body, {ContactColumn(detection), bottom_px});
  // Upwards, or so flat that a pixel more is metres.
  if (!ray.has_value() || !(above_m > 0.2) || !(ray->z() < -0.02)) return std::nullopt;
  const double contact_m = above_m * ray->head<2>().norm() / -ray->z();
  const Eigen::Vector3d view = Eigen::Vector3d(ray->x(), ray->y(), 0.0).normalized();
  double sigma_m = contact_m * contact_m * kContactPx / (body.camera->fy * above_m) + kContactM;
  sigma_m = std::hypot(sigma_m, kLegsM + kHiddenLegsM * (1.0 - body.visibility));
  if (!detection.has_joints) sigma_m *= kBoxOnlyFactor;
  return RangeCue(body, view, contact_m - NearestTipM(body, view), sigma_m);
}

std::optional<PositionCue> HeadTopCue(const PlacedBody& body, double floor_z_map) {
  const HumanDetection& detection = *body.detection;
  if (!detection.has_joints || detection.joint_visibility[kHead] < kJointVisibilityMin ||
      detection.box_px[1] <= kBorderPx) {
    return std::nullopt;
  }
  const auto ray = MapRay(body, {detection.joints_px[kHead].x(), detection.box_px[1]});
  const auto legs_m = LegsM(body);
  if (!ray.has_value() || !legs_m.has_value()) return std::nullopt;
  const double flat = ray->head<2>().norm();
  const Eigen::Vector3d& head = body.joints_map[kHead];
  const double top_m = *legs_m + head.z() + kHeadJointToTopM;
  const double above_m = floor_z_map + top_m - body.map_T_camera.position.z();
  if (!(std::abs(above_m) > kHeadAboveMinM) || !(ray->z() * above_m > 0.0) || !(flat > 0.05)) {
    return std::nullopt;
  }
  const double head_m = above_m * flat / ray->z();
  const Eigen::Vector3d view = Eigen::Vector3d(ray->x(), ray->y(), 0.0).normalized();
  const double top_sigma_m =
      std::hypot(kStatureM, kSkeletonHeightM + kHiddenSkeletonHeightM * (1.0 - body.visibility));
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
          std::min(sigma_m, kSkeletonHeightM + kHiddenSkeletonHeightM * (1.0 - body.visibility));
    }
  }
  PositionCue cue;
  cue.kind = PositionCue::Kind::kTorsoHeight;
  cue.torso_map = {body.torso_map.x(), body.torso_map.y(), floor_z_map + height_m};
  cue.information_map(2, 2) = 1.0 / (sigma_m * sigma_m);
  return cue;
}

}  // namespace dsg::ingest
