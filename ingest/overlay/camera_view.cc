// SPDX-License-Identifier: Apache-2.0
#include "ingest/overlay/camera_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

// Nearer points have no use in a picture, and no sound pixel.
constexpr double kNearM = 0.1;
// Between samples of a line.
constexpr double kStepM = 0.05;
// Boxes lie around the mesh of what they are of, and outlines in that of the walls: this much
// behind a face a line is still on it.
constexpr double kOnFaceM = 0.2;
constexpr double kOnFaceShare = 0.03;

double CrossOf(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

CameraView::CameraView(const CameraCalibration& camera, const Pose3d& map_T_camera)
    : camera_(camera),
      center_map_(map_T_camera.position),
      camera_T_map_(map_T_camera.Inverse()),
      radius_max_(RadiusMax(camera)),
      inverse_depth_(static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height)) {}

std::optional<CameraView::Seen> CameraView::See(const Eigen::Vector3d& point_map) const {
  const Eigen::Vector3d point_camera = camera_T_map_ * point_map;
  if (point_camera.z() < kNearM) return std::nullopt;
  if (point_camera.head<2>().norm() > radius_max_ * point_camera.z()) return std::nullopt;
  return Seen{Project(camera_, point_camera), point_camera.z()};
}

void CameraView::AddMesh(const MeshBlock& block) {
  std::vector<std::optional<Seen>> seen;
  seen.reserve(block.positions_map.size());
  for (const Eigen::Vector3f& point : block.positions_map)
    seen.push_back(See(point.cast<double>()));
  for (const auto& [a, b, c] : block.faces) {
    if (seen[a].has_value() && seen[b].has_value() && seen[c].has_value()) {
      AddFace(*seen[a], *seen[b], *seen[c]);
    }
  }
}

void CameraView::AddFace(const Seen& a, const Seen& b, const Seen& c) {
  const Eigen::Vector2d low = a.pixel.cwiseMin(b.pixel).cwiseMin(c.pixel);
  const Eigen::Vector2d high = a.pixel.cwiseMax(b.pixel).cwiseMax(c.pixel);
  const double area = CrossOf(b.pixel - a.pixel, c.pixel - a.pixel);
  if (area == 0.0 || high.x() < 0.0 || high.y() < 0.0) return;
  const int x_end = static_cast<int>(std::min(high.x(), camera_.width - 1.0));
  const int y_end = static_cast<int>(std::min(high.y(), camera_.height - 1.0));
  for (int y = static_cast<int>(std::ceil(std::max(low.y(), 0.0))); y <= y_end; ++y) {
    for (int x = static_cast<int>(std::ceil(std::max(low.x(), 0.0))); x <= x_end; ++x) {
      const Eigen::Vector2d pixel(x, y);
      const double to_b = CrossOf(pixel - a.pixel, c.pixel - a.pixel) / area;
      const double to_c = CrossOf(b.pixel - a.pixel, pixel - a.pixel) / area;
      if (to_b < 0.0 || to_c < 0.0 || to_b + to_c > 1.0) continue;
      // The inverse of depth is linear in the image.
      const double inverse = (1.0 - to_b - to_c) / a.depth_m + to_b / b.depth_m + to_c / c.depth_m;
      float& nearest = inverse_depth_[static_cast<size_t>(y) * static_cast<size_t>(camera_.width) +
                                      static_cast<size_t>(x)];
      nearest = std::max(nearest, static_cast<float>(inverse));
    }
  }
}

bool CameraView::IsInImage(const Eigen::Vector2d& pixel) const {
  // Pixel centres are at whole numbers.
  return pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < camera_.width - 0.5 &&
         pixel.y() < camera_.height - 0.5;
}

bool CameraView::IsBehindMesh(const Seen& seen) const {
  const auto column = static_cast<size_t>(std::lround(seen.pixel.x()));
  const auto row = static_cast<size_t>(std::lround(seen.pixel.y()));
  const float inverse = inverse_depth_[row * static_cast<size_t>(camera_.width) + column];
  if (inverse <= 0.0f) return false;
  const double face_m = 1.0 / static_cast<double>(inverse);
  return seen.depth_m > face_m + kOnFaceM + kOnFaceShare * face_m;
}

std::vector<ImageStroke> CameraView::StrokesOf(const Eigen::Vector3d& from_map,
                                               const Eigen::Vector3d& to_map) const {
  constexpr double kStepsMax = 2000.0;
  const double steps = std::ceil((to_map - from_map).norm() / kStepM);
  const int step_count = static_cast<int>(std::clamp(steps, 1.0, kStepsMax));
  std::vector<ImageStroke> strokes;
  bool goes_on = false;
  for (int step = 0; step <= step_count; ++step) {
    const double part = static_cast<double>(step) / step_count;
    const std::optional<Seen> seen = See(from_map + part * (to_map - from_map));
    if (!seen.has_value() || !IsInImage(seen->pixel)) {
      goes_on = false;
      continue;
    }
    const bool is_hidden = IsBehindMesh(*seen);
    if (goes_on && strokes.back().is_hidden != is_hidden) {
      // Both stretches touch.
      strokes.back().points_px.push_back(seen->pixel);
      goes_on = false;
    }
    if (!goes_on) strokes.push_back({.points_px = {}, .is_hidden = is_hidden});
    strokes.back().points_px.push_back(seen->pixel);
    goes_on = true;
  }
  return strokes;
}

}  // namespace dsg::ingest
