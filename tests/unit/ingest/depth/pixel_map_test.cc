// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/pixel_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ingest/sensor/pinhole.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/depth/depth_test_util.h"

namespace dsg::ingest {
namespace {

CameraCalibration BentCamera(Distortion distortion) {
  CameraCalibration camera = TestCamera("depth0", 640, 480);
  camera.distortion = distortion;
  camera.distortion_coefficients = distortion == Distortion::kEquidistant
                                       ? std::vector<double>{-0.01, 0.02, -0.01, 0.002}
                                       : std::vector<double>{-0.28, 0.07, 2e-4, 1.8e-5};
  return camera;
}

TEST(Pinhole, RaysOfPixelsProjectBackWithEveryDistortion) {
  Random random(/*seed=*/1, /*stream=*/1);
  for (const Distortion distortion :
       {Distortion::kNone, Distortion::kRadialTangential, Distortion::kEquidistant}) {
    const CameraCalibration camera =
        distortion == Distortion::kNone ? TestCamera("depth0", 640, 480) : BentCamera(distortion);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector2d pixel(random.Uniform(0, 639), random.Uniform(0, 479));
      const std::optional<Eigen::Vector3d> ray = RayOf(camera, pixel);
      ASSERT_TRUE(ray.has_value()) << pixel.transpose();
      EXPECT_LT((Project(camera, *ray) - pixel).norm(), 2e-3);
    }
  }
}

TEST(Pinhole, NoRayBeyondTheFoldOfTheDistortion) {
  CameraCalibration camera = BentCamera(Distortion::kRadialTangential);
  camera.distortion_coefficients = {-0.5, 0.0, 0.0, 0.0};
  // d/dr (r - r^3 / 2) = 0 at r = sqrt(2/3), which is 0.544 in the image.
  EXPECT_NEAR(RadiusMax(camera), std::sqrt(2.0 / 3.0), 0.011);
  EXPECT_FALSE(RayOf(camera, {camera.cx + 0.6 * camera.fx, camera.cy}).has_value());
}

TEST(PixelMap, OfACameraOntoItselfIsTheIdentity) {
  const CameraCalibration camera = TestCamera("depth0");
  const PixelMap map(camera, camera);
  EXPECT_TRUE(map.IsIdentity());
  EXPECT_EQ(map[17], 17);
}

TEST(PixelMap, FindsThePixelOfTheSameRay) {
  CameraCalibration source = BentCamera(Distortion::kRadialTangential);
  source.width = 320;
  source.height = 240;
  source.fx = source.fy = 250.0;
  source.cx = 160.0;
  source.cy = 119.0;
  source.body_T_camera.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d(1.0, 2.0, 3.0).normalized()));
  const CameraCalibration target = TestCamera("depth0", 160, 120);
  const PixelMap map(target, source);
  ASSERT_EQ(map.pixel_count(), 160u * 120u);
  int found_count = 0;
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      const Eigen::Vector3d ray =
          source.body_T_camera.orientation.conjugate() * PinholeRay(target, u, v);
      const Eigen::Vector2d at = Project(source, ray);
      const int32_t index = map[static_cast<size_t>(v * 160 + u)];
      if (index < 0) {
        EXPECT_TRUE(at.x() < 0.0 || at.y() < 0.0 || at.x() > 319.0 || at.y() > 239.0);
        continue;
      }
      ++found_count;
      EXPECT_LE(std::abs(at.x() - index % 320), 0.5);
      EXPECT_LE(std::abs(at.y() - index / 320), 0.5);
    }
  }
  EXPECT_GT(found_count, 15'000);
}

}  // namespace
}  // namespace dsg::ingest
