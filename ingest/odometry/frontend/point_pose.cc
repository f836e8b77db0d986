// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/point_pose.h"

#include <optional>

#include "ingest/odometry/frontend/sighting_pose.h"

namespace dsg::ingest {
namespace {

constexpr int kPointSample = 3;

// From a motion on the right of the pose to the position along the axes of the map.
Matrix6d AlongMap(const Matrix6d& covariance, const Eigen::Quaterniond& map_R_camera) {
  Matrix6d turn = Matrix6d::Identity();
  turn.topLeftCorner<3, 3>() = map_R_camera.toRotationMatrix();
  return turn * covariance * turn.transpose();
}

}  // namespace

PointPose PoseOfPoints(std::span<const PointSight> sights, const CameraCalibration& camera,
                       const Pose3d& guess, const RelativePoseOptions& options) {
  std::vector<PointSighting> sightings;
  // Where each was among those given.
  std::vector<int> given;
  for (size_t i = 0; i < sights.size(); ++i) {
    if (!sights[i].point_map.allFinite() || !sights[i].pixel.allFinite()) continue;
    PointSighting sighting;
    sighting.point = sights[i].point_map;
    sighting.pixel = sights[i].pixel;
    sighting.pixel_sigma_px = options.pixel_sigma_px;
    sightings.push_back(sighting);
    given.push_back(static_cast<int>(i));
  }
  PointPose result;
  if (std::ssize(sightings) < kPointSample) return result;
  result.outcome = PoseOutcome::kNoConsensus;
  const double gate = options.inlier_px / options.pixel_sigma_px;
  const SightingPoseSearch search(camera, camera,
                                  {gate * gate, options.refine_count, options.consensus});
  const std::optional<Pose3d> place = search.Consensus(sightings, guess, &result.draw_count);
  if (!place.has_value()) return result;
  // Points in line leave a turn open.
  const std::optional<SightingPose> pose = search.Refined(sightings, *place);
  if (!pose.has_value()) return result;
  result.outcome = PoseOutcome::kFound;
  result.map_T_camera = pose->from_T_to;
  result.covariance = AlongMap(pose->covariance, pose->from_T_to.orientation);
  for (const int i : pose->inliers) result.inliers.push_back(given[static_cast<size_t>(i)]);
  return result;
}

}  // namespace dsg::ingest
