// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/stereo_match.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "ingest/odometry/frontend/image_rectifier.h"
#include "ingest/sensor/pinhole.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/odometry/frontend/made_images.h"

namespace dsg::ingest {
namespace {

constexpr double kPairBaselineM = 0.1;

struct RealPair {
  CameraCalibration left = ImageCamera();
  CameraCalibration right = ImageCamera();

  explicit RealPair(double baseline_m = kPairBaselineM) {
    right.name = "cam1";
    right.body_T_camera.position.x() = baseline_m;
  }
};

// Barrel distortion, a degree of twist, another principal point.
RealPair BentPair() {
  RealPair pair;
  for (CameraCalibration* camera : {&pair.left, &pair.right}) {
    camera->distortion = Distortion::kRadialTangential;
    camera->distortion_coefficients = {-0.28, 0.07, 2e-4, 1.8e-5};
  }
  pair.right.cy -= 4.0;
  pair.right.body_T_camera.orientation =
      Eigen::AngleAxisd(-0.02, Eigen::Vector3d(1.0, -0.5, 2.0).normalized());
  return pair;
}

// A plane in the body's frame with normal * point = distance, and grey levels along x and y.
struct TexturedPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double distance = 2.0;
  std::function<double(double x, double y)> gray = [](double x, double y) {
    return WaveTexture(x / 0.06, y / 0.06);
  };
};

Image Seen(const CameraCalibration& camera, const TexturedPlane& plane) {
  return PaintedImage(camera.width, camera.height, [&](int u, int v) {
    const auto ray = RayOf(camera, Eigen::Vector2d(u, v));
    if (!ray.has_value()) return 0.0;
    const Eigen::Vector3d turned = camera.body_T_camera.orientation * *ray;
    const Eigen::Vector3d& origin = camera.body_T_camera.position;
    const double scale = (plane.distance - plane.normal.dot(origin)) / plane.normal.dot(turned);
    const Eigen::Vector3d at = origin + scale * turned;
    return plane.gray(at.x(), at.y());
  });
}

std::vector<Eigen::Vector2d> GridOfPixels() {
  std::vector<Eigen::Vector2d> pixels;
  for (int y = 20; y <= 220; y += 25) {
    for (int x = 60; x <= 350; x += 29) pixels.emplace_back(x + 0.3, y - 0.4);
  }
  return pixels;
}

struct MatchRun {
  RectifiedPair pair;
  std::vector<Eigen::Vector2d> pixels = GridOfPixels();
  std::vector<StereoMatch> matches;

  std::map<StereoOutcome, int> Counts() const {
    std::map<StereoOutcome, int> counts;
    for (const StereoMatch& match : matches) ++counts[match.outcome];
    return counts;
  }
  int Count(StereoOutcome outcome) const {
    const auto counts = Counts();
    return counts.count(outcome) != 0 ? counts.at(outcome) : 0;
  }
  int size() const { return static_cast<int>(matches.size()); }
};

MatchRun MatchPlane(const RealPair& real, const TexturedPlane& plane,
                    const StereoMatchOptions& options = {}) {
  const absl::StatusOr<RectifiedPair> pair = RectifiedPair::Make(real.left, real.right);
  EXPECT_TRUE(pair.ok()) << pair.status();
  const ImageRectifier left(pair->left, real.left);
  const ImageRectifier right(pair->right, real.right);
  const absl::StatusOr<StereoMatcher> matcher = StereoMatcher::Make(*pair, options);
  EXPECT_TRUE(matcher.ok()) << matcher.status();
  MatchRun run{*pair};
  const auto matches = matcher->Match(*left.Apply(Seen(real.left, plane)),
                                      *right.Apply(Seen(real.right, plane)), run.pixels);
  EXPECT_TRUE(matches.ok()) << matches.status();
  run.matches = *matches;
  return run;
}

// Of the matched ones, pixels, ascending.
std::vector<double> DisparityErrorsPx(const MatchRun& run, const TexturedPlane& plane) {
  std::vector<double> errors;
  const CameraCalibration& left = run.pair.left;
  for (size_t i = 0; i < run.matches.size(); ++i) {
    if (run.matches[i].outcome != StereoOutcome::kMatched) continue;
    const Eigen::Vector3d ray = PinholeRay(left, run.pixels[i].x(), run.pixels[i].y());
    const Eigen::Vector3d turned = left.body_T_camera.orientation * ray;
    const double depth_m =
        (plane.distance - plane.normal.dot(left.body_T_camera.position)) / plane.normal.dot(turned);
    errors.push_back(
        std::abs(run.matches[i].disparity_px - left.fx * std::abs(run.pair.baseline_m) / depth_m));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

void ExpectMatched(const MatchRun& run, const TexturedPlane& plane) {
  EXPECT_GT(run.Count(StereoOutcome::kMatched), run.size() * 8 / 10)
      << testing::PrintToString(run.Counts());
  const std::vector<double> errors = DisparityErrorsPx(run, plane);
  ASSERT_FALSE(errors.empty());
  EXPECT_LT(errors[errors.size() / 2], 0.1);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.3);
  for (const StereoMatch& match : run.matches) {
    if (match.outcome == StereoOutcome::kMatched) {
      EXPECT_LT(std::abs(match.row_offset_px), 0.5);
    }
  }
}

TEST(StereoMatcher, FindsThePlaceOfEachFeature) {
  for (const double distance_m : {0.7, 1.0, 2.0, 4.0}) {
    SCOPED_TRACE(distance_m);
    TexturedPlane plane;
    plane.distance = distance_m;
    // As coarse in the image at any distance.
    plane.gray = [=](double x, double y) {
      return WaveTexture(x / (0.03 * distance_m), y / (0.03 * distance_m));
    };
    ExpectMatched(MatchPlane(RealPair(), plane), plane);
  }
}

TEST(StereoMatcher, FindsThemOnASlantedPlane) {
  TexturedPlane plane;
  plane.normal = Eigen::Vector3d(0.3, 0.4, 1.0).normalized();
  ExpectMatched(MatchPlane(RealPair(), plane), plane);
}

TEST(StereoMatcher, FindsThemInRectifiedImagesOfABentPair) {
  const TexturedPlane plane;
  ExpectMatched(MatchPlane(BentPair(), plane), plane);
}

TEST(StereoMatcher, TheRightCameraMayStandOnTheLeft) {
  const TexturedPlane plane;
  const MatchRun run = MatchPlane(RealPair(-kPairBaselineM), plane);
  EXPECT_LT(run.pair.baseline_m, 0.0);
  // What the right camera does not see is on the other side.
  EXPECT_GT(run.Count(StereoOutcome::kMatched), run.size() * 7 / 10);
  EXPECT_LT(DisparityErrorsPx(run, plane)[10], 0.1);
}

TEST(StereoMatcher, PatternsThatRepeatAreAmbiguous) {
  TexturedPlane plane;
  // Waves of 0.08 m are 9 pixels.
  plane.gray = [](double x, double y) {
    return 128.0 + 50.0 * std::sin(2.0 * M_PI * x / 0.08) + 50.0 * std::sin(2.0 * M_PI * y / 0.08);
  };
  const MatchRun run = MatchPlane(RealPair(), plane);
  EXPECT_EQ(run.Count(StereoOutcome::kAmbiguous), run.size())
      << testing::PrintToString(run.Counts());
}

TEST(StereoMatcher, BlankWallsHaveNoDepth) {
  TexturedPlane plane;
  plane.gray = [](double x, double) { return 100.0 + x; };
  const MatchRun run = MatchPlane(RealPair(), plane);
  EXPECT_EQ(run.Count(StereoOutcome::kFlat), run.size());
}

TEST(StereoMatcher, WhatIsTooNearOrTooFarIsNoMatch) {
  TexturedPlane plane;
  StereoMatchOptions options;
  options.nearest_m = 3.0;
  const MatchRun near = MatchPlane(RealPair(), plane, options);
  EXPECT_LT(near.Count(StereoOutcome::kMatched), near.size() / 20);
  options.nearest_m = 0.5;
  options.farthest_m = 1.5;
  const MatchRun far = MatchPlane(RealPair(), plane, options);
  EXPECT_LT(far.Count(StereoOutcome::kMatched), far.size() / 20);
  EXPECT_GT(far.Count(StereoOutcome::kOutOfRange), far.size() * 8 / 10);
}

// The right camera looks up by more than was calibrated.
TEST(StereoMatcher, PlacesOffTheRowAreNoMatch) {
  const TexturedPlane plane;
  RealPair real;
  const absl::StatusOr<RectifiedPair> pair = RectifiedPair::Make(real.left, real.right);
  ASSERT_TRUE(pair.ok());
  for (const double off_px : {2.0, 4.0}) {
    CameraCalibration moved = real.right;
    moved.cy += off_px;
    const auto matches = StereoMatcher::Make(*pair)->Match(Seen(real.left, plane),
                                                           Seen(moved, plane), GridOfPixels());
    ASSERT_TRUE(matches.ok());
    int matched_count = 0;
    for (const StereoMatch& match : *matches) {
      if (match.outcome == StereoOutcome::kMatched) ++matched_count;
    }
    EXPECT_LT(matched_count, std::ssize(*matches) / 12) << off_px;
  }
}

TEST(StereoMatcher, AnotherPictureIsUnlike) {
  const RealPair real;
  TexturedPlane other;
  other.gray = [](double x, double y) { return WaveTexture(x / 0.06, y / 0.06, 1.1); };
  const auto matches = StereoMatcher::Make(*RectifiedPair::Make(real.left, real.right))
                           ->Match(Seen(real.left, {}), Seen(real.right, other), GridOfPixels());
  ASSERT_TRUE(matches.ok());
  int matched_count = 0;
  for (const StereoMatch& match : *matches) {
    if (match.outcome == StereoOutcome::kMatched) ++matched_count;
  }
  EXPECT_LT(matched_count, std::ssize(*matches) / 12);
}

TEST(StereoMatcher, BordersAndNoNumbersAreNoMatch) {
  const RealPair real;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector2d> pixels = {{0.0, 0.0},     {3.0, 100.0}, {-50.0, 100.0},
                                               {100.0, 238.0}, {1e12, 1e12}, {nan, 100.0}};
  const Image image = Seen(real.left, {});
  const auto matcher = StereoMatcher::Make(*RectifiedPair::Make(real.left, real.right));
  ASSERT_TRUE(matcher.ok());
  const auto matches = matcher->Match(image, image, pixels);
  ASSERT_TRUE(matches.ok());
  for (const StereoMatch& match : *matches) EXPECT_EQ(match.outcome, StereoOutcome::kAtBorder);
  EXPECT_TRUE(matcher->Match(image, image, {})->empty());
}

TEST(StereoMatcher, IsTheSameAgain) {
  const TexturedPlane plane;
  const MatchRun once = MatchPlane(BentPair(), plane);
  const MatchRun again = MatchPlane(BentPair(), plane);
  for (size_t i = 0; i < once.matches.size(); ++i) {
    EXPECT_EQ(once.matches[i].outcome, again.matches[i].outcome);
    EXPECT_EQ(once.matches[i].disparity_px, again.matches[i].disparity_px);
  }
}

TEST(StereoMatcher, RefusesWhatDoesNotFit) {
  const RealPair real;
  const RectifiedPair pair = *RectifiedPair::Make(real.left, real.right);
  StereoMatchOptions options;
  options.nearest_m = 20.0;
  EXPECT_EQ(ReasonOf(StereoMatcher::Make(pair, options).status()), Reason::kFieldInvalid);
  options = {};
  options.patch_reach_px = 0;
  EXPECT_EQ(ReasonOf(StereoMatcher::Make(pair, options).status()), Reason::kFieldInvalid);
  const auto matcher = StereoMatcher::Make(pair);
  const Image image = Seen(real.left, {});
  EXPECT_EQ(ReasonOf(matcher->Match(image, Image{}, {}).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(matcher->Match(Image{}, image, {}).status()), Reason::kFieldInvalid);
}

TEST(ImageRectifier, TellsWhatIsNotSeen) {
  const RealPair real;
  CameraCalibration turned = real.left;
  turned.body_T_camera.orientation = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY());
  const ImageRectifier rectifier(turned, real.left);
  const absl::StatusOr<Image> image = rectifier.Apply(Seen(real.left, {}));
  ASSERT_TRUE(image.ok());
  ASSERT_EQ(rectifier.unseen().size(), image->bytes.size());
  for (size_t i = 0; i < image->bytes.size(); ++i) {
    if (rectifier.unseen()[i] != 0) {
      EXPECT_EQ(image->bytes[i], 0);
    }
  }
  // It looks to the right.
  EXPECT_EQ(rectifier.unseen()[image->Offset(10, 120)], 0);
  EXPECT_EQ(rectifier.unseen()[image->Offset(370, 120)], 1);
  EXPECT_EQ(ReasonOf(rectifier.Apply(Image{}).status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::ingest
