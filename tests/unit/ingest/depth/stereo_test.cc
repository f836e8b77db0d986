// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/stereo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <string>
#include <utility>
#include <vector>

#include "ingest/sensor/pinhole.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/depth/depth_test_util.h"

namespace dsg::ingest {
namespace {

constexpr double kBaselineM = 0.1;

// Distance along a ray from `origin` to the scene; both in the body's frame, x right, z forward.
using Scene = std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray)>;

double PlaneHit(double z, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  return (z - origin.z()) / ray.z();
}

Scene Plane(double z) {
  return [z](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    return PlaneHit(z, origin, ray);
  };
}

// A near board on the left before a far wall.
Scene Step(double near_m, double far_m) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    const double s = PlaneHit(near_m, origin, ray);
    return (origin + s * ray).x() < 0.0 ? s : PlaneHit(far_m, origin, ray);
  };
}

// Grey of a place: waves of 6 to 40 cm in many directions.
double Texture(const Eigen::Vector3d& point) {
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2.4 * i;
    const double length_m = 0.06 * std::pow(1.19, i);
    sum += std::sin(2.0 * M_PI / length_m *
                        (std::cos(angle) * point.x() + std::sin(angle) * point.y()) +
                    1.7 * i);
  }
  return 128.0 + 28.0 * sum;
}

Image Render(const CameraCalibration& camera, const Scene& scene, bool is_blank = false) {
  return GrayImage(camera.width, camera.height, [&](int u, int v) {
    const auto ray = RayOf(camera, Eigen::Vector2d(u, v));
    if (!ray.has_value() || is_blank) return 90.0;
    const Eigen::Vector3d turned = camera.body_T_camera.orientation * *ray;
    const Eigen::Vector3d& origin = camera.body_T_camera.position;
    return Texture(origin + scene(origin, turned) * turned);
  });
}

struct Pair {
  CameraCalibration left;
  CameraCalibration right;
};

Pair IdealPair(int width = 320, int height = 240) {
  Pair pair{TestCamera("cam0", width, height), TestCamera("cam1", width, height)};
  pair.right.body_T_camera.position.x() = kBaselineM;
  return pair;
}

// As EuRoC's: barrel distortion, a degree or two of twist, other principal points.
Pair RealPair() {
  Pair pair = IdealPair();
  for (CameraCalibration* camera : {&pair.left, &pair.right}) {
    camera->distortion = Distortion::kRadialTangential;
    camera->distortion_coefficients = {-0.28, 0.07, 2e-4, 1.8e-5};
  }
  pair.right.cx += 3.0;
  pair.right.cy -= 4.0;
  pair.right.fx *= 1.01;
  pair.left.body_T_camera.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d(1.0, 1.0, 1.0).normalized()));
  pair.right.body_T_camera.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(-0.025, Eigen::Vector3d(1.0, -0.5, 2.0).normalized()));
  pair.right.body_T_camera.position += Eigen::Vector3d(0.0, 0.002, -0.001);
  return pair;
}

struct Errors {
  double valid_share = 0.0;
  double median_px = 0.0;
  double p95_px = 0.0;
};

// In disparities, which err alike at any distance.
Errors Compare(const StereoDepth& stereo, const std::vector<float>& depth_m, const Scene& scene) {
  const CameraCalibration& camera = stereo.camera();
  std::vector<double> errors_px;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double found_m = depth_m[static_cast<size_t>(v * camera.width + u)];
      if (found_m <= 0.0) continue;
      const Eigen::Vector3d ray = PinholeRay(camera, u, v);
      const double true_m =
          scene(camera.body_T_camera.position, camera.body_T_camera.orientation * ray);
      errors_px.push_back(camera.fx * kBaselineM * std::abs(1.0 / found_m - 1.0 / true_m));
    }
  }
  if (errors_px.empty()) return {};
  std::sort(errors_px.begin(), errors_px.end());
  return {static_cast<double>(errors_px.size()) / static_cast<double>(depth_m.size()),
          errors_px[errors_px.size() / 2], errors_px[errors_px.size() * 95 / 100]};
}

Errors Measure(const Pair& pair, const Scene& scene) {
  const absl::StatusOr<StereoDepth> stereo = StereoDepth::Make(pair.left, pair.right, 6.0);
  EXPECT_TRUE(stereo.ok()) << stereo.status();
  const auto depth_m = stereo->Compute(Render(pair.left, scene), Render(pair.right, scene));
  EXPECT_TRUE(depth_m.ok()) << depth_m.status();
  const Errors errors = Compare(*stereo, *depth_m, scene);
  testing::Test::RecordProperty("valid_share", std::to_string(errors.valid_share));
  return errors;
}

TEST(StereoDepth, PlanesAtAnyDistanceAreWithinAQuarterPixel) {
  for (const double metres : {0.8, 1.5, 3.0, 5.0}) {
    const Errors errors = Measure(IdealPair(), Plane(metres));
    EXPECT_GT(errors.valid_share, 0.8) << metres;
    EXPECT_LT(errors.median_px, 0.1) << metres;
    EXPECT_LT(errors.p95_px, 0.25) << metres;
  }
}

TEST(StereoDepth, DistortedAndTwistedCamerasAreRectified) {
  const Errors errors = Measure(RealPair(), Plane(2.0));
  EXPECT_GT(errors.valid_share, 0.75);
  EXPECT_LT(errors.median_px, 0.1);
  EXPECT_LT(errors.p95_px, 0.3);
}

TEST(StereoDepth, FisheyesAreRectified) {
  Pair pair = IdealPair();
  for (CameraCalibration* camera : {&pair.left, &pair.right}) {
    camera->distortion = Distortion::kEquidistant;
    camera->distortion_coefficients = {-0.01, 0.02, -0.01, 0.002};
    camera->fx = camera->fy = 180.0;
  }
  const Errors errors = Measure(pair, Plane(1.5));
  EXPECT_GT(errors.valid_share, 0.6);
  EXPECT_LT(errors.median_px, 0.1);
}

TEST(StereoDepth, TheReferenceMayStandOnTheRight) {
  Pair pair = IdealPair();
  std::swap(pair.left.body_T_camera, pair.right.body_T_camera);
  const Errors errors = Measure(pair, Step(1.5, 3.0));
  EXPECT_GT(errors.valid_share, 0.7);
  EXPECT_LT(errors.median_px, 0.1);
}

TEST(StereoDepth, StepIsSharpAndTheHiddenStripIsEmpty) {
  const Pair pair = IdealPair();
  const Scene scene = Step(1.0, 3.0);
  const absl::StatusOr<StereoDepth> stereo = StereoDepth::Make(pair.left, pair.right, 0.0);
  ASSERT_TRUE(stereo.ok());
  const auto depth_m = stereo->Compute(Render(pair.left, scene), Render(pair.right, scene));
  ASSERT_TRUE(depth_m.ok());
  const Errors errors = Compare(*stereo, *depth_m, scene);
  EXPECT_GT(errors.valid_share, 0.75);
  EXPECT_LT(errors.median_px, 0.12);
  EXPECT_LT(errors.p95_px, 1.0);
  // Readings between board and wall would be a curtain in the air.
  const int64_t between_count = std::count_if(depth_m->begin(), depth_m->end(), [](float metres) {
    return metres > 1.1f && metres < 2.7f;
  });
  EXPECT_LT(static_cast<double>(between_count), 0.005 * static_cast<double>(depth_m->size()));
}

TEST(StereoDepth, BlankWallsAndFarOnesGiveNoReading) {
  const Pair pair = IdealPair();
  const absl::StatusOr<StereoDepth> stereo = StereoDepth::Make(pair.left, pair.right, 4.0);
  ASSERT_TRUE(stereo.ok());
  const auto blank =
      stereo->Compute(Render(pair.left, Plane(2.0), true), Render(pair.right, Plane(2.0), true));
  ASSERT_TRUE(blank.ok());
  EXPECT_EQ(std::count(blank->begin(), blank->end(), 0.0f), std::ssize(*blank));
  const auto far = stereo->Compute(Render(pair.left, Plane(5.0)), Render(pair.right, Plane(5.0)));
  ASSERT_TRUE(far.ok());
  EXPECT_GT(static_cast<double>(std::count(far->begin(), far->end(), 0.0f)),
            0.99 * static_cast<double>(far->size()));
}

// Far from its default each number makes other depth of one of these scenes.
TEST(StereoDepth, ReadsEachOfItsNumbers) {
  const Pair pair = RealPair();
  std::vector<std::pair<Image, Image>> pictures;
  for (const Scene& scene : {Step(0.8, 3.0), Plane(4.0)}) {
    pictures.emplace_back(Render(pair.left, scene), Render(pair.right, scene));
  }
  const auto compute = [&](const StereoOptions& options) {
    const absl::StatusOr<StereoDepth> stereo =
        StereoDepth::Make(pair.left, pair.right, 6.0, options);
    EXPECT_TRUE(stereo.ok()) << stereo.status();
    std::vector<float> all;
    for (const auto& [left, right] : pictures) {
      const auto depth_m = stereo->Compute(left, right);
      EXPECT_TRUE(depth_m.ok()) << depth_m.status();
      all.insert(all.end(), depth_m->begin(), depth_m->end());
    }
    return all;
  };
  const std::vector<float> usual = compute({});
  DepthOptions options;
  int count = 0;
  for (const BoundOption& field : options.Bind()) {
    const std::string name = field.name;
    const bool is_of_pair =
        name.rfind("depth-stereo-", 0) == 0 || name.rfind("depth-refine-", 0) == 0;
    // Which pairs are matched is not asked here.
    if (!is_of_pair || name == "depth-stereo-period") continue;
    ++count;
    const double before = field.Get();
    field.Set(field.max);
    bool is_read = compute(options.stereo) != usual;
    field.Set(field.min);
    is_read = is_read || compute(options.stereo) != usual;
    field.Set(before);
    EXPECT_TRUE(is_read) << name;
  }
  EXPECT_EQ(count, 16);
}

TEST(StereoDepth, ThreadsChangeNoBit) {
  const Pair pair = RealPair();
  const Scene scene = Step(1.0, 3.0);
  const Image left = Render(pair.left, scene);
  const Image right = Render(pair.right, scene);
  const int before = cv::getNumThreads();
  std::vector<std::vector<float>> results;
  for (const int thread_count : {1, 2}) {
    cv::setNumThreads(thread_count);
    const absl::StatusOr<StereoDepth> stereo = StereoDepth::Make(pair.left, pair.right, 0.0);
    ASSERT_TRUE(stereo.ok());
    results.push_back(*stereo->Compute(left, right));
  }
  cv::setNumThreads(before);
  EXPECT_EQ(results[0], results[1]);
}

TEST(StereoDepth, RefusesPairsThatGiveNoDepth) {
  const auto reason = [](const Pair& pair) {
    return ReasonOf(StereoDepth::Make(pair.left, pair.right, 0.0).status());
  };
  Pair size = IdealPair();
  size.right.width = 100;
  Pair near = IdealPair();
  near.right.body_T_camera.position.x() = 0.0005;
  Pair apart = IdealPair();
  apart.right.body_T_camera.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitY()));
  Pair above = IdealPair();
  above.right.body_T_camera.position = {0.0, 0.1, 0.0};
  Pair behind = IdealPair();
  behind.right.body_T_camera.position = {0.01, 0.0, 0.1};
  Pair broken = IdealPair();
  broken.right.fx = 0.0;
  for (const Pair& pair : {size, near, apart, above, behind, broken}) {
    EXPECT_EQ(reason(pair), Reason::kFieldInvalid);
  }
}

TEST(StereoDepth, RefusesImagesOfAnotherSize) {
  const Pair pair = IdealPair();
  const absl::StatusOr<StereoDepth> stereo = StereoDepth::Make(pair.left, pair.right, 0.0);
  ASSERT_TRUE(stereo.ok());
  const Image good = Render(pair.left, Plane(2.0));
  const Image small = GrayImage(64, 48, [](int, int) { return 0.0; });
  Image torn = good;
  torn.bytes.pop_back();
  for (const Image& bad : {small, torn, ColorImage(320, 240, 1)}) {
    EXPECT_EQ(ReasonOf(stereo->Compute(good, bad).status()), Reason::kFieldInvalid);
    EXPECT_EQ(ReasonOf(stereo->Compute(bad, good).status()), Reason::kFieldInvalid);
  }
}

TEST(FrameMaker, PairsGiveFramesAtTheStereoPeriod) {
  const Pair pair = IdealPair();
  RigCalibration rig;
  rig.cameras = {pair.left, pair.right};
  PosedFrameMaker maker(rig, {});
  ASSERT_TRUE(maker.CanMakeFrames());
  const Image left = Render(pair.left, Plane(2.0));
  const Image right = Render(pair.right, Plane(2.0));
  for (int i = 0; i < 21; ++i) {
    const TimeNs t = i * 50 * kMs;
    maker.AddPose(t, At(0.01 * i));
    maker.AddPicture(Shot(t, "cam0", left));
    // Stamps of one shutter jitter; one right image is missing.
    if (i != 8) maker.AddPicture(Shot(t + (i % 2) * kMs, "cam1", right));
  }
  const std::vector<DepthFrame> frames = Drain(&maker);
  std::vector<TimeNs> stamps;
  for (const DepthFrame& frame : frames) stamps.push_back(frame.time_ns / kMs);
  EXPECT_EQ(stamps, (std::vector<TimeNs>{0, 200, 450, 650, 850}));
  EXPECT_EQ(maker.skips(), (SkipCounts{{"no right image", 1}}));
  for (const DepthFrame& frame : frames) {
    EXPECT_TRUE(frame.is_stereo);
    EXPECT_EQ(frame.rgb.size(), 3 * frame.depth_m.size());
  }
}

}  // namespace
}  // namespace dsg::ingest
