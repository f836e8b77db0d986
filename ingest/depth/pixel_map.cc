// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/pixel_map.h"

#include <cmath>

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

// A difference of a tenth of a pixel at the corners is none when the nearest pixel is taken.
constexpr double kSamePixels = 0.1;

int32_t SourceOf(const CameraCalibration& source, double radius_max, const Eigen::Vector3d& ray) {
  if (ray.z() <= 0.0 || ray.head<2>().norm() > radius_max * ray.z()) return -1;
  const Eigen::Vector2d at = Project(source, ray);
  if (!at.allFinite() || std::abs(at.x()) > 1e6 || std::abs(at.y()) > 1e6) return -1;
  const long u = std::lround(at.x());
  const long v = std::lround(at.y());
  if (u < 0 || v < 0 || u >= source.width || v >= source.height) return -1;
  return static_cast<int32_t>(v * source.width + u);
}

bool ShowTheSame(const CameraCalibration& target, const CameraCalibration& source,
                 const Eigen::Matrix3d& source_R_target) {
  if (target.width != source.width || target.height != source.height) return false;
  if (source.distortion != Distortion::kNone) return false;
  for (const double u : {0.0, target.width - 1.0}) {
    for (const double v : {0.0, target.height - 1.0}) {
      const Eigen::Vector3d ray = source_R_target * PinholeRay(target, u, v);
      if (ray.z() <= 0.0) return false;
      if ((Project(source, ray) - Eigen::Vector2d(u, v)).norm() > kSamePixels) return false;
    }
  }
  return true;
}

}  // namespace

PixelMap::PixelMap(const CameraCalibration& target, const CameraCalibration& source)
    : pixel_count_(static_cast<size_t>(target.width) * static_cast<size_t>(target.height)) {
  const Eigen::Matrix3d source_R_target =
      (source.body_T_camera.orientation.conjugate() * target.body_T_camera.orientation)
          .toRotationMatrix();
  if (ShowTheSame(target, source, source_R_target)) return;
  const double radius_max = RadiusMax(source);
  source_of_.reserve(pixel_count_);
  for (int v = 0; v < target.height; ++v) {
    for (int u = 0; u < target.width; ++u) {
      source_of_.push_back(
          SourceOf(source, radius_max, source_R_target * PinholeRay(target, u, v)));
    }
  }
}

}  // namespace dsg::ingest
