// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/feature_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <iostream>
#include <map>
#include <opencv2/core/utility.hpp>
#include <set>

#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/odometry/frontend/made_images.h"

namespace dsg::ingest {
namespace {

// Pixels of the shortest wave of the texture.
constexpr double kWavePx = 9.0;

// A plane under a homography from the first image's pixels to this one's.
Image PlaneUnder(const Eigen::Matrix3d& homography, double phase = 0.0) {
  const CameraCalibration camera = ImageCamera();
  const Eigen::Matrix3d inverse = homography.inverse();
  return PaintedImage(camera.width, camera.height, [&](int u, int v) {
    const Eigen::Vector2d at = (inverse * Eigen::Vector3d(u, v, 1.0)).hnormalized();
    return WaveTexture(at.x() / kWavePx, at.y() / kWavePx, phase);
  });
}

Image Plane() { return PlaneUnder(Eigen::Matrix3d::Identity()); }

Image Blank() {
  const CameraCalibration camera = ImageCamera();
  return PaintedImage(camera.width, camera.height, [](int, int) { return 90.0; });
}

// What a camera that turns sees: pixels of the first image to those of the turned camera.
Eigen::Matrix3d TurnedBy(const Eigen::Quaterniond& first_R_now) {
  const CameraCalibration camera = ImageCamera();
  Eigen::Matrix3d k;
  k << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  return k * first_R_now.toRotationMatrix().transpose() * k.inverse();
}

FeatureTracker MakeTracker(const FeatureTrackerOptions& options = {}) {
  absl::StatusOr<FeatureTracker> tracker = FeatureTracker::Make(ImageCamera(), options);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  return *std::move(tracker);
}

// With features of the plane.
FeatureTracker StartedTracker(const FeatureTrackerOptions& options = {}) {
  FeatureTracker tracker = MakeTracker(options);
  EXPECT_TRUE(tracker.Track(Plane()).ok());
  EXPECT_TRUE(tracker.Detect().ok());
  EXPECT_GT(tracker.features().size(), 40u);
  return tracker;
}

using Pixels = std::map<int64_t, Eigen::Vector2d>;

Pixels PixelsOf(const FeatureTracker& tracker) {
  Pixels pixels;
  for (const Feature& feature : tracker.features()) pixels[feature.id] = feature.pixel;
  return pixels;
}

// Distances from where the homography puts the first image's features, ascending.
std::vector<double> ErrorsPx(const Pixels& first, const FeatureTracker& tracker,
                             const Eigen::Matrix3d& homography) {
  std::vector<double> errors;
  for (const Feature& feature : tracker.features()) {
    const Eigen::Vector2d truth = (homography * first.at(feature.id).homogeneous()).hnormalized();
    errors.push_back((feature.pixel - truth).norm());
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

TEST(FeatureTracker, FollowsAPlaneWithinAFifthOfAPixel) {
  // Shifts, turns about the axis, comes nearer and tilts.
  Eigen::Matrix3d step;
  step << 1.01, -0.02, 6.3, 0.02, 1.01, -4.7, 1e-5, -2e-5, 1.0;
  FeatureTracker tracker = StartedTracker();
  const Pixels first = PixelsOf(tracker);
  Eigen::Matrix3d homography = Eigen::Matrix3d::Identity();
  for (int image = 1; image <= 3; ++image) {
    homography = step * homography;
    const absl::StatusOr<TrackCounts> counts = tracker.Track(PlaneUnder(homography));
    ASSERT_TRUE(counts.ok());
    EXPECT_EQ(counts->tracked, static_cast<int>(tracker.features().size()));
    const std::vector<double> errors = ErrorsPx(first, tracker, homography);
    ASSERT_GT(errors.size(), 0.75 * static_cast<double>(first.size())) << image;
    // Each image adds what the change of view within a window does.
    EXPECT_LT(errors[errors.size() / 2], 0.06 * image) << image;
    EXPECT_LT(errors[errors.size() * 95 / 100], 0.1 + 0.1 * image) << image;
    for (const Feature& feature : tracker.features()) EXPECT_EQ(feature.image_count, image);
  }
}

TEST(FeatureTracker, GoesBackToTheImageBeforeOneThatShowsNothing) {
  FeatureTracker tracker = StartedTracker();
  const Pixels first = PixelsOf(tracker);
  tracker.GoBack();
  EXPECT_EQ(PixelsOf(tracker), first) << "there is no image before the first";
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(tracker.Track(Blank()).ok());
    EXPECT_LT(tracker.features().size(), first.size() / 4);
    tracker.GoBack();
    EXPECT_EQ(PixelsOf(tracker), first);
  }
  Eigen::Matrix3d aside = Eigen::Matrix3d::Identity();
  aside(0, 2) = -5.0;
  ASSERT_TRUE(tracker.Track(PlaneUnder(aside)).ok());
  const std::vector<double> errors = ErrorsPx(first, tracker, aside);
  ASSERT_GT(errors.size(), 0.75 * static_cast<double>(first.size()));
  EXPECT_LT(errors[errors.size() / 2], 0.1);
}

TEST(FeatureTracker, CountsWhatBecomesOfFeatures) {
  FeatureTracker tracker = StartedTracker();
  const int before = static_cast<int>(tracker.features().size());
  Eigen::Matrix3d aside = Eigen::Matrix3d::Identity();
  aside(0, 2) = -12.0;
  const TrackCounts counts = *tracker.Track(PlaneUnder(aside));
  EXPECT_EQ(
      counts.tracked + counts.left + counts.lost + counts.strayed + counts.masked + counts.merged,
      before);
  // Those of the left margin.
  EXPECT_GT(counts.left, 0);
  EXPECT_GT(counts.tracked, before / 2);
}

// A weak texture, seen by a camera that turns and whose lens darkens the borders.
Image DarkenedUnder(const Eigen::Matrix3d& homography) {
  const CameraCalibration camera = ImageCamera();
  const Eigen::Matrix3d inverse = homography.inverse();
  return PaintedImage(camera.width, camera.height, [&](int u, int v) {
    const Eigen::Vector2d at = (inverse * Eigen::Vector3d(u, v, 1.0)).hnormalized();
    const double weak = 110.0 + 0.12 * (WaveTexture(at.x() / kWavePx, at.y() / kWavePx) - 128.0);
    const double x = (u - camera.cx) / camera.cx;
    const double y = (v - camera.cy) / camera.cx;
    return weak * (1.0 - 0.4 * (x * x + y * y));
  });
}

TEST(FeatureTracker, IsNotHeldBackByALensThatDarkensTheBorders) {
  const auto lag_px = [](int flat_reach_px) {
    FeatureTrackerOptions options;
    options.flat_reach_px = flat_reach_px;
    options.corner_gradient_min = 0.5;
    FeatureTracker tracker = MakeTracker(options);
    EXPECT_TRUE(tracker.Track(DarkenedUnder(Eigen::Matrix3d::Identity())).ok());
    EXPECT_TRUE(tracker.Detect().ok());
    const Pixels first = PixelsOf(tracker);
    const Eigen::Quaterniond step(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()));
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    for (int image = 0; image < 4; ++image) {
      turn = turn * step;
      EXPECT_TRUE(tracker.Track(DarkenedUnder(TurnedBy(turn)), step).ok());
    }
    double sum = 0.0;
    for (const Feature& feature : tracker.features()) {
      sum += feature.pixel.x() -
             (TurnedBy(turn) * first.at(feature.id).homogeneous()).hnormalized().x();
    }
    EXPECT_GT(tracker.features().size(), 30u);
    return sum / static_cast<double>(tracker.features().size());
  };
  const double before = lag_px(0);
  const double after = lag_px(FeatureTrackerOptions().flat_reach_px);
  std::cout << "mean lag " << before << " px, with flat images " << after << " px\n";
  // The scene moves to the left.
  EXPECT_GT(before, 0.1);
  EXPECT_LT(std::abs(after), 0.25 * before);
}

TEST(FeatureTracker, StartsFromAKnownRotation) {
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(0.25, Eigen::Vector3d(0.1, 1.0, 0.1).normalized()));
  const Eigen::Matrix3d homography = TurnedBy(turn);
  FeatureTracker knowing = StartedTracker();
  FeatureTracker unknowing = StartedTracker();
  const Pixels first = PixelsOf(knowing);
  const TrackCounts with = *knowing.Track(PlaneUnder(homography), turn);
  const TrackCounts without = *unknowing.Track(PlaneUnder(homography));
  EXPECT_GT(with.left, 0);
  EXPECT_GT(with.tracked, 0.8 * static_cast<double>(first.size() - static_cast<size_t>(with.left)));
  EXPECT_LT(without.tracked, with.tracked / 4);
  const std::vector<double> errors = ErrorsPx(first, knowing, homography);
  // Views from 14 degrees apart are a third larger at one side; turned first they look alike.
  EXPECT_LT(errors[errors.size() / 2], 0.1);
}

TEST(FeatureTracker, FindsOneCornerInEachEmptyCell) {
  const FeatureTrackerOptions options;
  FeatureTracker tracker = StartedTracker();
  std::set<std::pair<int, int>> cells;
  const CameraCalibration camera = ImageCamera();
  for (const Feature& feature : tracker.features()) {
    const int x = static_cast<int>(feature.pixel.x());
    const int y = static_cast<int>(feature.pixel.y());
    EXPECT_TRUE(cells.insert({x / options.cell_px, y / options.cell_px}).second) << x << " " << y;
    EXPECT_GE(x, options.border_px);
    EXPECT_LT(x, camera.width - options.border_px);
    EXPECT_GE(y, options.border_px);
    EXPECT_LT(y, camera.height - options.border_px);
    for (const Feature& other : tracker.features()) {
      if (other.id == feature.id) continue;
      EXPECT_GE((other.pixel - feature.pixel).norm(), options.apart_px_min);
    }
  }
  // 11 x 7 cells, of which some have their corner too near to a neighbour's.
  EXPECT_GT(cells.size(), 50u);
}

TEST(FeatureTracker, FillsGapsAtTheNextKeyframeWithNewIds) {
  FeatureTracker tracker = StartedTracker();
  const Pixels first = PixelsOf(tracker);
  std::vector<int64_t> dropped;
  for (const auto& [id, pixel] : first) {
    if (pixel.x() < 150.0) dropped.push_back(id);
  }
  dropped.push_back(1'000'000);
  tracker.Drop(dropped);
  ASSERT_EQ(tracker.features().size(), first.size() - dropped.size() + 1);
  ASSERT_EQ(*tracker.Detect(), static_cast<int>(dropped.size()) - 1);
  int64_t last = -1;
  for (const Feature& feature : tracker.features()) {
    EXPECT_GT(feature.id, last);
    last = feature.id;
    const bool is_new = first.count(feature.id) == 0;
    EXPECT_EQ(feature.keyframe_count, is_new ? 0 : 1);
    if (is_new) {
      EXPECT_LT(feature.pixel.x(), 150.0);
    }
  }
  EXPECT_EQ(last, static_cast<int64_t>(first.size() + dropped.size()) - 2);
}

TEST(FeatureTracker, KeepsToTheCount) {
  FeatureTrackerOptions options;
  options.feature_count_max = 12;
  FeatureTracker tracker = MakeTracker(options);
  ASSERT_TRUE(tracker.Track(Plane()).ok());
  EXPECT_EQ(*tracker.Detect(), 12);
  EXPECT_EQ(*tracker.Detect(), 0);
}

TEST(FeatureTracker, DropsWhatIsTooOldAtAKeyframe) {
  FeatureTrackerOptions options;
  options.keyframe_count_max = 2;
  FeatureTracker tracker = StartedTracker(options);
  const Pixels first = PixelsOf(tracker);
  for (int keyframe = 1; keyframe <= 3; ++keyframe) {
    ASSERT_TRUE(tracker.Track(Plane()).ok());
    ASSERT_TRUE(tracker.Detect().ok());
    for (const auto& [id, pixel] : PixelsOf(tracker)) {
      if (keyframe == 3) {
        EXPECT_EQ(first.count(id), 0u) << id;
      }
    }
  }
  EXPECT_GT(tracker.features().size(), 40u);
}

std::vector<uint8_t> RightHalf() {
  const CameraCalibration camera = ImageCamera();
  std::vector<uint8_t> mask;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) mask.push_back(u >= 200 ? 1 : 0);
  }
  return mask;
}

TEST(FeatureTracker, FindsAndFollowsNothingBeneathTheMask) {
  const FeatureTrackerOptions options;
  const double edge = 200.0 - options.mask_growth_px;
  FeatureTracker finding = MakeTracker();
  ASSERT_TRUE(finding.Track(Plane()).ok());
  EXPECT_GT(*finding.Detect(RightHalf()), 15);
  for (const Feature& feature : finding.features()) EXPECT_LT(feature.pixel.x(), edge);

  FeatureTracker following = StartedTracker();
  const TrackCounts counts = *following.Track(Plane(), Eigen::Quaterniond::Identity(), RightHalf());
  EXPECT_GT(counts.masked, 15);
  EXPECT_GT(counts.tracked, 15);
  for (const Feature& feature : following.features()) EXPECT_LT(feature.pixel.x(), edge + 0.5);
}

TEST(FeatureTracker, OlderOnesStayWhereTwoMeet) {
  FeatureTrackerOptions options;
  options.merge_px = 40.0;
  FeatureTracker tracker = StartedTracker(options);
  const TrackCounts counts = *tracker.Track(Plane());
  EXPECT_GT(counts.merged, 0);
  EXPECT_EQ(tracker.features().front().id, 0);
  for (const Feature& a : tracker.features()) {
    for (const Feature& b : tracker.features()) {
      if (a.id != b.id) {
        EXPECT_GE((a.pixel - b.pixel).norm(), 40.0);
      }
    }
  }
}

TEST(FeatureTracker, BlankImagesHaveNoFeaturesAndLoseThem) {
  FeatureTracker tracker = MakeTracker();
  EXPECT_EQ(*tracker.Detect(), 0);
  ASSERT_TRUE(tracker.Track(Blank()).ok());
  EXPECT_EQ(*tracker.Detect(), 0);
  // Followed twice, so that no test of new features is what loses them.
  FeatureTracker covered = StartedTracker();
  ASSERT_TRUE(covered.Track(Plane()).ok());
  const int before = static_cast<int>(covered.features().size());
  const TrackCounts counts = *covered.Track(Blank());
  EXPECT_EQ(counts.tracked, 0);
  EXPECT_EQ(counts.lost + counts.left, before);
  EXPECT_TRUE(covered.features().empty());
  ASSERT_TRUE(covered.Track(Plane()).ok());
  EXPECT_GT(*covered.Detect(), 40);
}

TEST(FeatureTracker, NoiseOfTheSensorIsNoCorner) {
  Random random(5, 0);
  const CameraCalibration camera = ImageCamera();
  FeatureTracker tracker = MakeTracker();
  const Image noise = PaintedImage(camera.width, camera.height,
                                   [&](int, int) { return 90.0 + 1.2 * random.Normal(); });
  ASSERT_TRUE(tracker.Track(noise).ok());
  EXPECT_EQ(*tracker.Detect(), 0);
}

TEST(FeatureTracker, AnotherPlaceLosesFeatures) {
  FeatureTracker tracker = StartedTracker();
  const size_t before = tracker.features().size();
  ASSERT_TRUE(tracker.Track(PlaneUnder(Eigen::Matrix3d::Identity(), /*phase=*/1.1)).ok());
  EXPECT_LT(tracker.features().size(), before / 10);
}

TEST(FeatureTracker, ResetForgetsFeaturesAndNotIds) {
  FeatureTracker tracker = StartedTracker();
  const int64_t last = tracker.features().back().id;
  tracker.Reset();
  EXPECT_TRUE(tracker.features().empty());
  EXPECT_EQ(*tracker.Detect(), 0);
  ASSERT_TRUE(tracker.Track(Plane()).ok());
  ASSERT_GT(*tracker.Detect(), 40);
  EXPECT_EQ(tracker.features().front().id, last + 1);
}

TEST(FeatureTracker, IsTheSameWithAnyNumberOfThreads) {
  const auto run = [](int thread_count) {
    cv::setNumThreads(thread_count);
    FeatureTracker tracker = StartedTracker();
    Eigen::Matrix3d aside = Eigen::Matrix3d::Identity();
    aside(0, 2) = 3.3;
    EXPECT_TRUE(tracker.Track(PlaneUnder(aside)).ok());
    return PixelsOf(tracker);
  };
  const Pixels one = run(1);
  EXPECT_EQ(run(2), one);
  EXPECT_EQ(run(-1), one);
}

TEST(FeatureTracker, RefusesWhatDoesNotFit) {
  EXPECT_EQ(ReasonOf(FeatureTracker::Make(ImageCamera(30, 240)).status()), Reason::kFieldInvalid);
  CameraCalibration bent = ImageCamera();
  bent.distortion = Distortion::kEquidistant;
  bent.distortion_coefficients = {0.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(ReasonOf(FeatureTracker::Make(bent).status()), Reason::kFieldInvalid);
  FeatureTrackerOptions options;
  options.level_count = 0;
  EXPECT_EQ(ReasonOf(FeatureTracker::Make(ImageCamera(), options).status()), Reason::kFieldInvalid);

  FeatureTracker tracker = StartedTracker();
  const Pixels before = PixelsOf(tracker);
  const auto refuses = [](const absl::Status& status, const std::string& what) {
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << status;
    EXPECT_NE(std::string(status.message()).find(what), std::string::npos) << status;
  };
  refuses(tracker.Track(PaintedImage(1, 1, [](int, int) { return 1.0; })).status(), "1 x 1");
  refuses(tracker.Track(Image{}).status(), "0 x 0");
  Image cut = Plane();
  cut.bytes.pop_back();
  refuses(tracker.Track(cut).status(), "90239 bytes");
  const std::vector<uint8_t> small_mask(7, 0);
  refuses(tracker.Track(Plane(), Eigen::Quaterniond::Identity(), small_mask).status(), "7 bytes");
  refuses(tracker.Detect(small_mask).status(), "7 bytes");
  const Eigen::Quaterniond broken(NAN, 0.0, 0.0, 0.0);
  refuses(tracker.Track(Plane(), broken).status(), "rotation");
  EXPECT_EQ(PixelsOf(tracker), before);
}

// The smallest image that is taken, smaller than the windows of the upper levels.
TEST(FeatureTracker, SmallImagesAreFollowed) {
  const FeatureTrackerOptions options;
  const int side = 2 * (options.border_px + options.window_reach_px) + 1;
  absl::StatusOr<FeatureTracker> tracker = FeatureTracker::Make(ImageCamera(side, side));
  ASSERT_TRUE(tracker.ok());
  const Image image =
      PaintedImage(side, side, [](int u, int v) { return WaveTexture(u / kWavePx, v / kWavePx); });
  ASSERT_TRUE(tracker->Track(image).ok());
  ASSERT_GT(*tracker->Detect(), 0);
  EXPECT_GT(tracker->Track(image)->tracked, 0);
}

}  // namespace
}  // namespace dsg::ingest
