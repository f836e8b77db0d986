// SPDX-License-Identifier: Apache-2.0
#include "ingest/sensor/rectify_lookup.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

CameraCalibration LookupCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 50.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  return camera;
}

TEST(RectifyLookup, IsEachPixelItselfWithoutDistortion) {
  const CameraCalibration camera = LookupCamera();
  const RectifyLookup lookup = MakeRectifyLookup(camera, camera);
  ASSERT_EQ(lookup.u.size(), 64u * 48u);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const auto i = static_cast<size_t>(64 * v + u);
      // Rounding may put a pixel of the border beyond it.
      if (u == 0 || v == 0 || u == 63 || v == 47) continue;
      EXPECT_EQ(lookup.inside[i], 255) << u << " " << v;
      EXPECT_NEAR(lookup.u[i], u, 1e-4);
      EXPECT_NEAR(lookup.v[i], v, 1e-4);
    }
  }
}

TEST(RectifyLookup, LeadsToWhereTheRealCameraSeesTheSame) {
  CameraCalibration real = LookupCamera();
  real.distortion = Distortion::kRadialTangential;
  real.distortion_coefficients = {-0.28, 0.07, 2e-4, 1.8e-5};
  CameraCalibration rectified = WithoutDistortion(real);
  rectified.body_T_camera.orientation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY());
  const RectifyLookup lookup = MakeRectifyLookup(rectified, real);
  size_t inside_count = 0;
  for (size_t i = 0; i < lookup.inside.size(); ++i) {
    if (lookup.inside[i] == 0) {
      EXPECT_LT(lookup.u[i], -100.0f);
      continue;
    }
    ++inside_count;
    const auto ray = RayOf(real, Eigen::Vector2d(lookup.u[i], lookup.v[i]));
    ASSERT_TRUE(ray.has_value());
    const Eigen::Vector3d turned = rectified.body_T_camera.orientation.conjugate() * *ray;
    const Eigen::Vector2d pixel = Project(rectified, turned);
    EXPECT_NEAR(pixel.x(), static_cast<double>(i % 64), 0.01);
    EXPECT_NEAR(pixel.y(), static_cast<double>(i / 64), 0.01);
  }
  // It looks aside by 5 of 64 columns.
  EXPECT_GT(inside_count, lookup.inside.size() * 8 / 10);
  EXPECT_LT(inside_count, lookup.inside.size());
}

}  // namespace
}  // namespace dsg::ingest
