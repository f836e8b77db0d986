// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/depth_cue.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "ingest/agents/detections/body_pixels.h"

namespace dsg::ingest {
namespace {

// Requires: not empty; 0 <= share <= 1. Changes the order.
double Quantile(double share, std::vector<double>* values) {
  const auto at =
      values->begin() +
      static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(values->size() - 1)));
  std::nth_element(values->begin(), at, values->end());
  return *at;
}

std::vector<Eigen::Vector3d> TrunkOf(const std::vector<Eigen::Vector3d>& points,
                                     const DepthCueOptions& options) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : points) heights.push_back(point.z());
  const double top = Quantile(options.top_share, &heights);
  std::vector<Eigen::Vector3d> trunk;
  for (const Eigen::Vector3d& point : points) {
    const double below_m = top - point.z();
    if (below_m >= options.shoulders_m && below_m <= options.pelvis_m) trunk.push_back(point);
  }
  return trunk;
}

double MedianAlong(const Eigen::Vector3d& axis, const Eigen::Vector3d& from,
                   const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> values;
  for (const Eigen::Vector3d& point : points) values.push_back(axis.dot(point - from));
  return Quantile(0.5, &values);
}

}  // namespace

std::optional<PositionCue> DepthImageCue(const PlacedBody& body, const DepthFrame& depth) {
  const DepthCueOptions& options = body.depth_options;
  const BodyPixels pixels = FindBodyPixels(body, depth);
  const std::vector<Eigen::Vector3d>& points = pixels.points_map;
  if (std::ssize(points) < options.trunk_count_min) return std::nullopt;
  std::vector<Eigen::Vector3d> trunk = TrunkOf(points, options);
  const bool is_trunk_seen = std::ssize(trunk) >= options.trunk_count_min;
  if (!is_trunk_seen) trunk = points;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : trunk) middle += point / static_cast<double>(trunk.size());
  const Eigen::Vector3d camera_map = depth.map_T_camera.position;
  const auto view = HorizontalView(camera_map, middle);
  if (!view.has_value()) return std::nullopt;
  const Eigen::Vector3d side(-view->y(), view->x(), 0.0);
  const double range_m = MedianAlong(*view, camera_map, trunk) + options.half_body_m;
  const double side_m = MedianAlong(side, camera_map, trunk);
  PositionCue cue;
  cue.kind = PositionCue::Kind::kDepthImage;
  cue.torso_map = camera_map + *view * range_m + side * side_m;
  cue.torso_map.z() = body.torso_map.z();
  // Without a label it may be somebody else's trunk.
  const double growth = (is_trunk_seen ? 1.0 : options.no_trunk_factor) *
                        (pixels.is_by_instance ? 1.0 : options.no_label_factor);
  const double per_m2 = depth.is_stereo ? options.stereo_per_m2 : options.range_per_m2;
  const double range_sigma_m = growth * (options.range_m + per_m2 * range_m * range_m);
  const double side_sigma_m =
      growth * (options.side_m + options.hidden_side_m * (1.0 - body.visibility));
  cue.information_map = *view * view->transpose() / (range_sigma_m * range_sigma_m) +
                        side * side.transpose() / (side_sigma_m * side_sigma_m);
  return cue;
}

}  // namespace dsg::ingest
