// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/window_landmarks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dsg::ingest {

using Eigen::Vector3d;

WindowLandmarks::WindowLandmarks(const StereoModel& model, const WindowOptions& options)
    : model_(model), options_(options) {}

void WindowLandmarks::AddSights(int64_t keyframe, std::span<const FeatureSight> sights) {
  for (const FeatureSight& sight : sights) {
    landmarks_[sight.feature_id].sights.push_back({keyframe, sight.sight});
  }
}

void WindowLandmarks::Anchor(const WindowPoses& poses) {
  for (auto& [id, landmark] : landmarks_) {
    if (landmark.anchor.has_value()) continue;
    if (!AnchorByDisparity(poses.calibration_error, &landmark)) AnchorByParallax(poses, &landmark);
  }
}

std::vector<int64_t> WindowLandmarks::DropMisfits(double miss_px_max, const WindowPoses& poses) {
  std::vector<int64_t> dropped;
  std::erase_if(landmarks_, [&](const auto& entry) {
    const auto& [id, landmark] = entry;
    const bool fits = !landmark.anchor.has_value() ||
                      (IsNearEnough(landmark.block[2]) && MissOf(landmark, poses) <= miss_px_max);
    if (!fits && landmark.sights.back().keyframe == poses.newest_keyframe()) dropped.push_back(id);
    return !fits;
  });
  return dropped;
}

void WindowLandmarks::DropSightsOf(int64_t oldest_keyframe) {
  for (auto& [id, landmark] : landmarks_) {
    if (landmark.sights.front().keyframe != oldest_keyframe) continue;
    if (landmark.anchor.has_value() && *landmark.anchor == 0) continue;
    landmark.sights.erase(landmark.sights.begin());
    if (landmark.anchor.has_value()) --*landmark.anchor;
  }
}

void WindowLandmarks::ForgetAnchoredIn(int64_t keyframe) {
  std::erase_if(landmarks_, [&](const auto& entry) {
    const WindowLandmark& landmark = entry.second;
    return landmark.sights.empty() ||
           (landmark.anchor.has_value() && landmark.anchor_keyframe() == keyframe);
  });
}

void WindowLandmarks::ForgetLost(int64_t newest_keyframe) {
  std::erase_if(landmarks_, [&](const auto& entry) {
    return !entry.second.anchor.has_value() &&
           entry.second.sights.back().keyframe != newest_keyframe;
  });
}

std::optional<Vector3d> WindowLandmarks::PointOf(int64_t feature_id,
                                                 const WindowPoses& poses) const {
  const auto entry = landmarks_.find(feature_id);
  if (entry == landmarks_.end()) return std::nullopt;
  return PointOf(entry->second, poses);
}

std::vector<SeenLandmark> WindowLandmarks::Told(const WindowPoses& poses) const {
  std::vector<SeenLandmark> all;
  for (const auto& [id, landmark] : landmarks_) {
    const std::optional<Vector3d> point = PointOf(landmark, poses);
    if (!point.has_value()) continue;
    SeenLandmark told{id, *point, {}, static_cast<int>(landmark.sights.size())};
    const WindowLandmark::Sight& last = landmark.sights.back();
    if (last.keyframe == poses.newest_keyframe()) told.pixel = last.seen.pixel;
    all.push_back(told);
  }
  return all;
}

std::optional<Vector3d> WindowLandmarks::PointOf(const WindowLandmark& landmark,
                                                 const WindowPoses& poses) const {
  // What is infinitely far is a direction.
  if (!landmark.anchor.has_value() || !(landmark.block[2] > 0.0)) return std::nullopt;
  const Vector3d ray(landmark.block[0], landmark.block[1], 1.0);
  const Pose3d map_T_anchor = poses.Of(landmark.anchor_keyframe()) * model_.imu_T_camera;
  return map_T_anchor * (ray / landmark.block[2]);
}

bool WindowLandmarks::IsNearEnough(double inverse_depth) const {
  return inverse_depth * options_.farthest_m >= 1.0 && inverse_depth * options_.nearest_m <= 1.0;
}

void WindowLandmarks::SetAnchor(size_t sight, double inverse_depth,
                                WindowLandmark* landmark) const {
  const Vector3d ray = model_.RayOf(landmark->sights[sight].seen.pixel);
  landmark->anchor = sight;
  landmark->block = {ray.x(), ray.y(), inverse_depth};
}

bool WindowLandmarks::AnchorByDisparity(const CalibrationError& error,
                                        WindowLandmark* landmark) const {
  for (size_t i = 0; i < landmark->sights.size(); ++i) {
    const std::optional<double>& disparity_px = landmark->sights[i].seen.disparity_px;
    if (!disparity_px.has_value()) continue;
    const double inverse_depth = InverseDepthOf(model_, error, *disparity_px);
    if (!IsNearEnough(inverse_depth)) continue;
    SetAnchor(i, inverse_depth, landmark);
    return true;
  }
  return false;
}

void WindowLandmarks::AnchorByParallax(const WindowPoses& poses, WindowLandmark* landmark) const {
  if (landmark->sights.size() < 2) return;
  const WindowLandmark::Sight& first = landmark->sights.front();
  const WindowLandmark::Sight& last = landmark->sights.back();
  const Pose3d map_T_first = poses.Of(first.keyframe) * model_.imu_T_camera;
  const Pose3d map_T_last = poses.Of(last.keyframe) * model_.imu_T_camera;
  const Vector3d a = map_T_first.orientation * model_.RayOf(first.seen.pixel);
  const Vector3d b = map_T_last.orientation * model_.RayOf(last.seen.pixel);
  const double sine_square = a.cross(b).squaredNorm() / (a.squaredNorm() * b.squaredNorm());
  const double sine_min = std::sin(options_.parallax_deg_min * M_PI / 180.0);
  if (sine_square < sine_min * sine_min) return;
  const Vector3d way = map_T_last.position - map_T_first.position;
  // s a - t b = way, least squares.
  const double det = a.dot(b) * a.dot(b) - a.squaredNorm() * b.squaredNorm();
  const double depth = (b.dot(way) * a.dot(b) - a.dot(way) * b.squaredNorm()) / det;
  if (!(depth > 0.0) || !IsNearEnough(1.0 / depth)) return;
  SetAnchor(0, 1.0 / depth, landmark);
  if (!(MissOf(*landmark, poses) <= options_.miss_px_max)) landmark->anchor.reset();
}

// Mean miss of its sights, pixels; infinite if one is not before the camera.
double WindowLandmarks::MissOf(const WindowLandmark& landmark, const WindowPoses& poses) const {
  const Pose3d map_T_anchor = poses.Of(landmark.anchor_keyframe());
  double sum = 0.0;
  double disparity_sum = 0.0;
  for (const WindowLandmark::Sight& sight : landmark.sights) {
    const std::optional<Vector3d> error =
        SightErrorOf(model_, map_T_anchor, poses.Of(sight.keyframe), sight.seen,
                     poses.MotionOf(sight.keyframe), landmark.block, poses.calibration_error);
    if (!error.has_value()) return std::numeric_limits<double>::infinity();
    sum += error->head<2>().norm();
    disparity_sum += std::abs(error->z());
  }
  return std::max(sum, disparity_sum) / static_cast<double>(landmark.sights.size());
}

}  // namespace dsg::ingest
