// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/seen_features.h"

#include <algorithm>
#include <utility>

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct SharedFeature {
  int64_t id;
  const SeenFeature* last;
  const SeenFeature* now;
};

// Ascending by id.
std::vector<SharedFeature> SharedBy(const SeenFeatures& last, const SeenFeatures& now) {
  std::vector<SharedFeature> shared;
  for (const auto& [id, seen] : now) {
    const auto before = last.find(id);
    if (before != last.end()) shared.push_back({id, &before->second, &seen});
  }
  return shared;
}

Vector3d RayThrough(const CameraCalibration& camera, const Vector2d& pixel) {
  return PinholeRay(camera, pixel.x(), pixel.y());
}

/// Features that both have with a disparity.
struct SharedPoints {
  std::vector<int64_t> ids;
  /// Of the same.
  std::vector<StereoPointPair> pairs;
};

SharedPoints PointsOf(const StereoCamera& camera, const SeenFeatures& last, const SeenFeatures& now,
                      const RelativePoseOptions& options) {
  SharedPoints shared;
  const auto point_of = [&](const SeenFeature& seen) {
    return StereoPointOf(camera.left, camera.baseline_m, seen.pixel, *seen.disparity_px, options);
  };
  for (const SharedFeature& feature : SharedBy(last, now)) {
    if (!feature.last->disparity_px.has_value() || !feature.now->disparity_px.has_value()) continue;
    shared.ids.push_back(feature.id);
    shared.pairs.push_back({point_of(*feature.last), point_of(*feature.now)});
  }
  return shared;
}

// Those of the ids that are not at the ascending indices.
std::vector<int64_t> IdsBeside(const std::vector<int64_t>& ids, const std::vector<int>& indices) {
  std::vector<int64_t> beside;
  size_t next = 0;
  for (size_t i = 0; i < ids.size(); ++i) {
    if (next < indices.size() && static_cast<size_t>(indices[next]) == i) {
      ++next;
    } else {
      beside.push_back(ids[i]);
    }
  }
  return beside;
}

}  // namespace

std::vector<int64_t> MonoOutliers(const StereoCamera& camera, const SeenFeatures& last,
                                  const SeenFeatures& now, const Quaterniond& last_R_now,
                                  OdometryMethod method, const RelativePoseOptions& options) {
  std::vector<int64_t> ids;
  std::vector<BearingPair> pairs;
  for (const SharedFeature& feature : SharedBy(last, now)) {
    ids.push_back(feature.id);
    pairs.push_back({RayThrough(camera.left, feature.last->pixel).normalized(),
                     RayThrough(camera.left, feature.now->pixel).normalized()});
  }
  const MonoPose pose = method == OdometryMethod::kFivePoint
                            ? FivePointPose(pairs, camera.left.fx, options)
                            : TwoPointPose(pairs, last_R_now, camera.left.fx, options);
  const bool is_known =
      pose.outcome == PoseOutcome::kFound || pose.outcome == PoseOutcome::kNoTranslation;
  return is_known ? IdsBeside(ids, pose.inliers) : std::vector<int64_t>();
}

StereoMotion StereoMotionOf(const StereoCamera& camera, const SeenFeatures& last,
                            const SeenFeatures& now, const Quaterniond& last_R_now,
                            OdometryMethod method, const RelativePoseOptions& options) {
  const SharedPoints shared = PointsOf(camera, last, now, options);
  const StereoPose pose = method == OdometryMethod::kFivePoint
                              ? ThreePointPose(shared.pairs, options)
                              : OnePointPose(shared.pairs, last_R_now, options);
  StereoMotion motion;
  motion.outcome = pose.outcome;
  if (pose.outcome != PoseOutcome::kFound) return motion;
  motion.last_T_now = pose.first_T_second;
  motion.inlier_share =
      static_cast<double>(pose.inliers.size()) / static_cast<double>(shared.pairs.size());
  motion.outliers = IdsBeside(shared.ids, pose.inliers);
  return motion;
}

double AgreeingShare(const StereoCamera& camera, const SeenFeatures& last, const SeenFeatures& now,
                     const Pose3d& last_T_now, const RelativePoseOptions& options) {
  const SharedPoints shared = PointsOf(camera, last, now, options);
  if (shared.pairs.empty()) return 0.0;
  return static_cast<double>(CountAgreeing(shared.pairs, last_T_now, options)) /
         static_cast<double>(shared.pairs.size());
}

std::optional<double> ParallaxOf(const StereoCamera& camera, const SeenFeatures& last,
                                 const SeenFeatures& now, const Quaterniond& last_R_now) {
  std::vector<double> flows;
  for (const SharedFeature& feature : SharedBy(last, now)) {
    const Vector3d ray = last_R_now * RayThrough(camera.left, feature.now->pixel);
    if (ray.z() <= 0.0) continue;
    const Vector2d turned(camera.left.fx * ray.x() / ray.z() + camera.left.cx,
                          camera.left.fy * ray.y() / ray.z() + camera.left.cy);
    flows.push_back((turned - feature.last->pixel).norm());
  }
  if (flows.empty()) return std::nullopt;
  const auto middle = flows.begin() + static_cast<std::ptrdiff_t>(flows.size() / 2);
  std::nth_element(flows.begin(), middle, flows.end());
  return *middle;
}

}  // namespace dsg::ingest
