// SPDX-License-Identifier: Apache-2.0
#include "ingest/sensor/rectify_lookup.h"

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {

RectifyLookup MakeRectifyLookup(const CameraCalibration& rectified, const CameraCalibration& real) {
  const size_t count = static_cast<size_t>(rectified.width) * static_cast<size_t>(rectified.height);
  constexpr float kOutside = -1e4f;
  RectifyLookup lookup{rectified.width, rectified.height, std::vector<float>(count, kOutside),
                       std::vector<float>(count, kOutside), std::vector<uint8_t>(count, 0)};
  const Eigen::Matrix3d real_R_rectified =
      (real.body_T_camera.orientation.conjugate() * rectified.body_T_camera.orientation)
          .toRotationMatrix();
  const double radius_max = RadiusMax(real);
  size_t i = 0;
  for (int v = 0; v < rectified.height; ++v) {
    for (int u = 0; u < rectified.width; ++u, ++i) {
      const Eigen::Vector3d ray = real_R_rectified * PinholeRay(rectified, u, v);
      if (ray.z() <= 0.0 || ray.head<2>().norm() > radius_max * ray.z()) continue;
      const Eigen::Vector2d at = Project(real, ray);
      if (!at.allFinite()) continue;
      if (at.x() < 0.0 || at.y() < 0.0 || at.x() > real.width - 1 || at.y() > real.height - 1) {
        continue;
      }
      lookup.u[i] = static_cast<float>(at.x());
      lookup.v[i] = static_cast<float>(at.y());
      lookup.inside[i] = 255;
    }
  }
  return lookup;
}

}  // namespace dsg::ingest
