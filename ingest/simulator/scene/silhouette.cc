// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/silhouette.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// What is nearer to the camera's plane than this is cut off.
constexpr float kNearM = 0.02f;

Vector2f PixelOf(const Vector3f& point, const ingest::CameraCalibration& camera) {
  return {static_cast<float>(camera.fx) * point.x() / point.z() + static_cast<float>(camera.cx),
          static_cast<float>(camera.fy) * point.y() / point.z() + static_cast<float>(camera.cy)};
}

// The polygon of a triangle before the near plane; up to four corners.
int Clip(const std::array<Vector3f, 3>& triangle, std::array<Vector3f, 4>* polygon) {
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    const Vector3f& a = triangle[i];
    const Vector3f& b = triangle[(i + 1) % 3];
    if (a.z() >= kNearM) (*polygon)[count++] = a;
    if ((a.z() >= kNearM) != (b.z() >= kNearM)) {
      (*polygon)[count++] = a + (b - a) * ((kNearM - a.z()) / (b.z() - a.z()));
    }
  }
  return count;
}

}  // namespace

PixelBox ImageBox(const ingest::CameraCalibration& camera) {
  return {0, 0, camera.width - 1, camera.height - 1};
}

PixelBox GrownBox(const ingest::CameraCalibration& camera) {
  const int columns = camera.width / 2;
  const int rows = camera.height / 2;
  return {-columns, -rows, camera.width + columns - 1, camera.height + rows - 1};
}

PixelBox ProjectedBox(const std::vector<Vector3f>& points_camera,
                      const ingest::CameraCalibration& camera) {
  const PixelBox grown = GrownBox(camera);
  Vector2f low = Vector2f::Constant(std::numeric_limits<float>::max());
  Vector2f high = -low;
  bool is_before = false;
  bool is_behind = false;
  for (const Vector3f& point : points_camera) {
    if (point.z() < kNearM) {
      is_behind = true;
      continue;
    }
    is_before = true;
    const Vector2f pixel = PixelOf(point, camera);
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  if (!is_before) return {};
  // Cut at the near plane, it may reach any border.
  if (is_behind) return grown;
  const auto clamp = [](float value, int min, int max) {
    return static_cast<int>(std::clamp(value, static_cast<float>(min), static_cast<float>(max)));
  };
  PixelBox box;
  if (high.x() < static_cast<float>(grown.column_min) ||
      low.x() > static_cast<float>(grown.column_max) ||
      high.y() < static_cast<float>(grown.row_min) || low.y() > static_cast<float>(grown.row_max)) {
    return box;
  }
  // One pixel more on each side than rounding could need.
  box.column_min = clamp(std::floor(low.x()) - 1.0f, grown.column_min, grown.column_max);
  box.column_max = clamp(std::ceil(high.x()) + 1.0f, grown.column_min, grown.column_max);
  box.row_min = clamp(std::floor(low.y()) - 1.0f, grown.row_min, grown.row_max);
  box.row_max = clamp(std::ceil(high.y()) + 1.0f, grown.row_min, grown.row_max);
  return box;
}

Silhouette::Silhouette(const ingest::CameraCalibration& camera)
    : camera_(camera),
      grown_(GrownBox(camera)),
      width_(grown_.column_max - grown_.column_min + 1),
      mask_(static_cast<size_t>(width_) *
            static_cast<size_t>(grown_.row_max - grown_.row_min + 1)) {}

int Silhouette::CountPixels(const std::vector<Vector3f>& points_camera,
                            const std::vector<std::array<uint32_t, 3>>& faces,
                            const PixelBox& box) {
  box_ = box;
  count_ = 0;
  if (box.IsEmpty()) return 0;
  for (const std::array<uint32_t, 3>& face : faces) {
    std::array<Vector3f, 4> polygon;
    const int count =
        Clip({points_camera[face[0]], points_camera[face[1]], points_camera[face[2]]}, &polygon);
    for (int i = 2; i < count; ++i) {
      Fill({PixelOf(polygon[0], camera_), PixelOf(polygon[i - 1], camera_),
            PixelOf(polygon[i], camera_)});
    }
  }
  for (int row = box.row_min; row <= box.row_max; ++row) {
    const auto begin = mask_.begin() + static_cast<ptrdiff_t>(row - grown_.row_min) * width_;
    std::fill(begin + (box.column_min - grown_.column_min),
              begin + (box.column_max - grown_.column_min + 1), uint8_t{0});
  }
  return count_;
}

void Silhouette::Fill(const std::array<Vector2f, 3>& corners) {
  const float low = std::min({corners[0].y(), corners[1].y(), corners[2].y()});
  const float high = std::max({corners[0].y(), corners[1].y(), corners[2].y()});
  const float top = std::max(std::ceil(low), static_cast<float>(box_.row_min));
  const float bottom = std::min(std::floor(high), static_cast<float>(box_.row_max));
  for (float y = top; y <= bottom; y += 1.0f) {
    float from = std::numeric_limits<float>::max();
    float to = -from;
    for (int i = 0; i < 3; ++i) {
      const Vector2f& a = corners[i];
      const Vector2f& b = corners[(i + 1) % 3];
      if ((a.y() < y && b.y() < y) || (a.y() > y && b.y() > y)) continue;
      const float rise = b.y() - a.y();
      const float x = rise == 0.0f ? a.x() : a.x() + (b.x() - a.x()) * ((y - a.y()) / rise);
      from = std::min({from, x, rise == 0.0f ? b.x() : x});
      to = std::max({to, x, rise == 0.0f ? b.x() : x});
    }
    FillRow(static_cast<int>(y), from, to);
  }
}

void Silhouette::FillRow(int row, float from, float to) {
  const float left = std::max(std::ceil(from), static_cast<float>(box_.column_min));
  const float right = std::min(std::floor(to), static_cast<float>(box_.column_max));
  uint8_t* const pixels = mask_.data() + static_cast<ptrdiff_t>(row - grown_.row_min) * width_;
  for (int column = static_cast<int>(left); column <= static_cast<int>(right); ++column) {
    uint8_t& pixel = pixels[column - grown_.column_min];
    count_ += 1 - pixel;
    pixel = 1;
  }
}

}  // namespace dsg::simulator
