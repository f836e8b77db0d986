// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/keyframe_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "schema/base/status.h"
#include "tests/unit/ingest/odometry/frontend/made_images.h"

namespace dsg::ingest {
namespace {

constexpr double kPlaneM = 2.0;
constexpr double kPairBaselineM = 0.1;

RectifiedPair MadePair() {
  RectifiedPair pair;
  pair.left = pair.right = ImageCamera();
  pair.right.name = "cam1";
  pair.right.body_T_camera.position.x() = kPairBaselineM;
  pair.baseline_m = kPairBaselineM;
  return pair;
}

// A plane across the view of a camera that stands `x_m` to the right.
Image PlaneFrom(double x_m) {
  const CameraCalibration camera = ImageCamera();
  return PaintedImage(camera.width, camera.height, [&](int u, int v) {
    return WaveTexture(0.25 * u + 0.25 * camera.fx * x_m / kPlaneM, 0.25 * v);
  });
}

KeyframeFeatureFinder MadeFinder(const KeyframeFeatureOptions& options = {}) {
  absl::StatusOr<KeyframeFeatureFinder> finder =
      KeyframeFeatureFinder::MakeStereo(MadePair(), options);
  EXPECT_TRUE(finder.ok()) << finder.status();
  return *std::move(finder);
}

TEST(KeyframeFeatureFinder, SpreadsCornersOverTheImage) {
  const Image image = PlaneFrom(0.0);
  const KeyframeFeatureOptions options{.feature_count_max = 200};
  const auto found = MadeFinder(options).Find({3, 77}, image);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->stamp.track, 3);
  EXPECT_EQ(found->stamp.time_ns, 77);
  EXPECT_EQ(found->descriptors.size(), found->features.size());
  EXPECT_LE(found->features.size(), 200u);
  EXPECT_GT(found->features.size(), 100u);
  int right_count = 0;
  for (size_t i = 0; i < found->features.size(); ++i) {
    const KeyframeFeature& feature = found->features[i];
    if (feature.pixel.x() > 0.5f * static_cast<float>(image.width)) ++right_count;
    EXPECT_EQ(feature.depth_m, 0.0f);
    EXPECT_FALSE(found->PointOf(i).has_value());
    EXPECT_GE(feature.pixel_sigma_px, 0.7f);
  }
  EXPECT_NEAR(right_count, 0.5 * static_cast<double>(found->features.size()), 40.0);
}

TEST(KeyframeFeatureFinder, StereoTellsDepths) {
  const auto found = MadeFinder().FindInPair({}, PlaneFrom(0.0), PlaneFrom(kPairBaselineM));
  ASSERT_TRUE(found.ok()) << found.status();
  int known_count = 0;
  for (size_t i = 0; i < found->features.size(); ++i) {
    const auto point = found->PointOf(i);
    if (!point.has_value()) continue;
    ++known_count;
    EXPECT_NEAR(point->point.z(), kPlaneM, 0.1);
    EXPECT_LT(found->BearingOf(i).cross(point->point.normalized()).norm(), 1e-6);
    EXPECT_NEAR(std::sqrt(point->covariance(2, 2)), found->features[i].depth_sigma_m, 1e-6);
    EXPECT_EQ(Eigen::LLT<Eigen::Matrix3d>(point->covariance).info(), Eigen::Success);
  }
  EXPECT_GT(known_count, 50);
}

TEST(KeyframeFeatureFinder, TakesDepthsButAtEdges) {
  // A step in the middle.
  const CameraCalibration camera = ImageCamera();
  const int middle = camera.width / 2;
  const auto depth = [&](int column, int /*row*/) { return column < middle ? 1.0f : 3.0f; };
  const auto found = MadeFinder().FindWithDepth({}, PlaneFrom(0.0), depth);
  ASSERT_TRUE(found.ok()) << found.status();
  const KeyframeFeatureOptions options;
  int near_count = 0;
  for (const KeyframeFeature& feature : found->features) {
    const int column = static_cast<int>(std::lround(feature.pixel.x()));
    const bool is_edge =
        column >= middle - options.depth_edge_px && column < middle + options.depth_edge_px;
    const float due = is_edge ? 0.0f : depth(column, 0);
    EXPECT_EQ(feature.depth_m, due) << column;
    if (is_edge) ++near_count;
    if (!is_edge) {
      EXPECT_NEAR(feature.depth_sigma_m, due == 1.0f ? 0.008 : 0.032, 1e-6);
    }
  }
  EXPECT_GT(near_count, 0);
}

TEST(KeyframeFeatureFinder, DepthsThatAreNoNumbersAreUnknown) {
  for (const float bad : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(), 1e9f}) {
    const auto found =
        MadeFinder().FindWithDepth({}, PlaneFrom(0.0), [&](int, int) { return bad; });
    ASSERT_TRUE(found.ok()) << found.status();
    for (const KeyframeFeature& feature : found->features) EXPECT_EQ(feature.depth_m, 0.0f);
  }
}

TEST(KeyframeFeatureFinder, FindsNothingBeneathTheMask) {
  const Image image = PlaneFrom(0.0);
  std::vector<uint8_t> mask(image.bytes.size(), 0);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < 150; ++u) mask[image.Offset(u, v)] = 1;
  }
  const auto found = MadeFinder().Find({}, image, mask);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_GT(found->features.size(), 50u);
  for (const KeyframeFeature& feature : found->features) {
    EXPECT_GE(feature.pixel.x(),
              150.0f + static_cast<float>(KeyframeFeatureOptions().mask_growth_px) - 4.0f);
  }
}

TEST(KeyframeFeatureFinder, FindsTheSameAgain) {
  const auto once = MadeFinder().FindInPair({}, PlaneFrom(0.0), PlaneFrom(kPairBaselineM));
  const auto again = MadeFinder().FindInPair({}, PlaneFrom(0.0), PlaneFrom(kPairBaselineM));
  ASSERT_TRUE(once.ok() && again.ok());
  EXPECT_EQ(once->descriptors, again->descriptors);
  ASSERT_EQ(once->features.size(), again->features.size());
  for (size_t i = 0; i < once->features.size(); ++i) {
    EXPECT_EQ(once->features[i].pixel, again->features[i].pixel);
    EXPECT_EQ(once->features[i].depth_m, again->features[i].depth_m);
  }
}

TEST(KeyframeFeatureFinder, BlankImagesHaveNoFeatures) {
  const CameraCalibration camera = ImageCamera();
  const Image blank = PaintedImage(camera.width, camera.height, [](int, int) { return 90.0; });
  const auto found = MadeFinder().FindInPair({}, blank, blank);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_TRUE(found->features.empty());
}

TEST(KeyframeFeatureFinder, RefusesWhatDoesNotFit) {
  const KeyframeFeatureFinder finder = MadeFinder();
  const Image small = PaintedImage(100, 80, [](int, int) { return 90.0; });
  EXPECT_EQ(ReasonOf(finder.Find({}, small).status()), Reason::kFieldInvalid);
  const Image image = PlaneFrom(0.0);
  EXPECT_EQ(ReasonOf(finder.FindInPair({}, image, small).status()), Reason::kFieldInvalid);
  const std::vector<uint8_t> mask(5, 0);
  EXPECT_EQ(ReasonOf(finder.Find({}, image, mask).status()), Reason::kFieldInvalid);
  CameraCalibration distorted = ImageCamera();
  distorted.distortion = Distortion::kRadialTangential;
  distorted.distortion_coefficients = {0.1, 0.0, 0.0, 0.0};
  EXPECT_EQ(ReasonOf(KeyframeFeatureFinder::Make(distorted).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(KeyframeFeatureFinder::Make(ImageCamera(), {.level_count = 0}).status()),
            Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
