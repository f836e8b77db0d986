// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "ingest/odometry/mesher/triangle_rules_internal.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Twice the area, in the direction of the normal.
Vector3d NormalOfCorners(const Corners& corners) {
  return (corners[1] - corners[0]).cross(corners[2] - corners[0]);
}

Vector3d MiddleOf(const Corners& corners) { return (corners[0] + corners[1] + corners[2]) / 3.0; }

// Positive when `at` is on one side of the line from `a` to `b`, negative on the other.
double SideOf(const Vector2d& a, const Vector2d& b, const Vector2d& at) {
  const Vector2d along = b - a;
  const Vector2d to = at - a;
  return along.x() * to.y() - along.y() * to.x();
}

}  // namespace

double LongestEdge(const Corners& corners) {
  return std::max({(corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm(),
                   (corners[0] - corners[2]).norm()});
}

double AspectOf(const Corners& corners) {
  const double longest = LongestEdge(corners);
  return longest > 0.0 ? NormalOfCorners(corners).norm() / (longest * longest) : 0.0;
}

double DepthRatioOf(const Corners& corners_camera) {
  const auto [least, most] =
      std::minmax({corners_camera[0].z(), corners_camera[1].z(), corners_camera[2].z()});
  return most / least;
}

double FacingOf(const Corners& corners_camera) {
  const Vector3d normal = NormalOfCorners(corners_camera);
  const Vector3d middle = MiddleOf(corners_camera);
  const double scale = normal.norm() * middle.norm();
  return scale > 0.0 ? std::abs(normal.dot(middle)) / scale : 0.0;
}

bool TurnsToCamera(const Corners& corners_camera) {
  return NormalOfCorners(corners_camera).dot(MiddleOf(corners_camera)) < 0.0;
}

bool TouchesMask(const std::array<Vector2d, 3>& pixels, std::span<const uint8_t> mask, int width) {
  if (mask.empty()) return false;
  const auto height = static_cast<int>(mask.size()) / width;
  const auto [top, bottom] = std::minmax({pixels[0].y(), pixels[1].y(), pixels[2].y()});
  const int first_row = std::max(0, static_cast<int>(std::ceil(top)));
  const int last_row = std::min(height - 1, static_cast<int>(std::floor(bottom)));
  for (int row = first_row; row <= last_row; ++row) {
    // Where the edges cross the row.
    double from = width;
    double to = -1.0;
    for (size_t corner = 0; corner < 3; ++corner) {
      const Vector2d& a = pixels[corner];
      const Vector2d& b = pixels[(corner + 1) % 3];
      if (std::min(a.y(), b.y()) > row || std::max(a.y(), b.y()) < row) continue;
      const double share = a.y() == b.y() ? 0.0 : (row - a.y()) / (b.y() - a.y());
      const double column = a.x() + share * (b.x() - a.x());
      from = std::min({from, column, a.y() == b.y() ? b.x() : column});
      to = std::max({to, column, a.y() == b.y() ? b.x() : column});
    }
    const int first = std::max(0, static_cast<int>(std::ceil(from)));
    const int last = std::min(width - 1, static_cast<int>(std::floor(to)));
    if (first > last) continue;
    const auto begin = mask.begin() + static_cast<ptrdiff_t>(row) * width;
    if (std::any_of(begin + first, begin + last + 1, [](uint8_t value) { return value != 0; })) {
      return true;
    }
  }
  return false;
}

double DepthWithin(const std::array<Vector2d, 3>& pixels, const std::array<double, 3>& depths,
                   const Vector2d& at) {
  const double whole = SideOf(pixels[0], pixels[1], pixels[2]);
  if (whole == 0.0) return 0.0;
  double inverse = 0.0;
  for (size_t corner = 0; corner < 3; ++corner) {
    const double share = SideOf(pixels[(corner + 1) % 3], pixels[(corner + 2) % 3], at) / whole;
    if (!(share > 0.0)) return 0.0;
    inverse += share / depths[corner];
  }
  return 1.0 / inverse;
}

}  // namespace dsg::ingest
