// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/texture.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "ingest/simulator/scene/image_effects.h"
#include "ingest/simulator/scene/renderer.h"
#include "tests/unit/ingest/simulator/scene/views.h"

namespace dsg::simulator {
namespace {

constexpr Material kAllMaterials[] = {
    Material::kPlaster, Material::kTiles,   Material::kCarpet, Material::kWood,  Material::kFabric,
    Material::kMetal,   Material::kPlastic, Material::kPaper,  Material::kBooks, Material::kLeaves,
    Material::kSkin,    Material::kGlass,   Material::kBlank};

// Mean square of the step from one pixel to the next along a line, in units of the variance.
double Roughness(const Surface& surface, float footprint) {
  double steps = 0.0;
  double sum = 0.0;
  double square = 0.0;
  constexpr int kCount = 4000;
  float before = 0.0f;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3f point(0.1f, 0.37f + footprint * static_cast<float>(i), 1.1f);
    const float value = Albedo(surface, point, 0, footprint).mean();
    if (i > 0) steps += (value - before) * (value - before);
    before = value;
    sum += value;
    square += value * value;
  }
  const double variance = square / kCount - (sum / kCount) * (sum / kCount);
  return variance > 1e-9 ? steps / kCount / variance : 0.0;
}

// White noise would give 2; what an image can hold without aliasing gives clearly less.
TEST(Texture, FadesWhatIsFinerThanPixels) {
  for (const Material material : kAllMaterials) {
    for (const float footprint : {0.001f, 0.003f, 0.01f, 0.03f, 0.1f, 0.3f}) {
      const Surface surface = MakeSurface(material, {160, 150, 140, 255}, 12);
      EXPECT_LT(Roughness(surface, footprint), 1.0)
          << static_cast<int>(material) << " at " << footprint;
    }
  }
}

TEST(Texture, StaysBetweenBlackAndWhite) {
  for (const Material material : kAllMaterials) {
    const Surface surface = MakeSurface(material, {250, 10, 128, 255}, 3);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3f point(0.013f * static_cast<float>(i) - 9.0f,
                                  -0.017f * static_cast<float>(i) + 4.0f, 1.3f);
      const Eigen::Vector3f color = Albedo(surface, point, i % 3, 0.002f);
      ASSERT_TRUE((color.array() >= 0.0f).all() && (color.array() <= 1.0f).all());
    }
  }
}

TEST(Texture, DiffersBetweenSeedsAndRepeatsForOne) {
  const Eigen::Vector3f point(1.234f, 5.678f, 0.9f);
  int different = 0;
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Surface a = MakeSurface(Material::kPlaster, {128, 128, 128, 255}, 4 * seed);
    const Surface b = MakeSurface(Material::kPlaster, {128, 128, 128, 255}, 4 * seed + 4);
    EXPECT_EQ(Albedo(a, point, 0, 0.002f), Albedo(a, point, 0, 0.002f));
    different += Albedo(a, point, 0, 0.002f) != Albedo(b, point, 0, 0.002f) ? 1 : 0;
  }
  EXPECT_GE(different, 18);
}

class TextureOfWorld : public testing::TestWithParam<WorldKind> {};
INSTANTIATE_TEST_SUITE_P(Worlds, TextureOfWorld,
                         testing::Values(WorldKind::kApartment, WorldKind::kWing,
                                         WorldKind::kOffice));

// Shi and Tomasi's corners at the reference settings, in images without noise.
TEST_P(TextureOfWorld, GivesCornersInNearlyAllViews) {
  const auto world = GenerateWorld({GetParam(), 1});
  ASSERT_TRUE(world.ok());
  const auto renderer = Renderer::Create(BuildScene(*world, {}));
  ASSERT_TRUE(renderer.ok());
  constexpr int kViewCount = 20;
  int rich = 0;
  for (const Pose3d& pose : TourViews(*world, kViewCount)) {
    const auto view = (*renderer)->Render(pose, ReferenceCamera(), {}, {});
    ASSERT_TRUE(view.ok());
    CameraEffects effects;
    effects.read_noise = effects.shot_noise = 0.0;
    Random random(1, 1);
    ingest::Image image = MakeGray(*view, effects, &random);
    const cv::Mat gray(image.height, image.width, CV_8U, image.bytes.data());
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(gray, corners, 300, 0.001, 8.0, cv::noArray(), 3);
    rich += corners.size() >= 250 ? 1 : 0;
  }
  EXPECT_GE(rich, 0.95 * kViewCount);
}

}  // namespace
}  // namespace dsg::simulator
