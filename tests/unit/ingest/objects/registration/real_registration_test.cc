// SPDX-License-Identifier: Apache-2.0
// Recorded clouds with a known motion (or one that can be checked). Printed figures are what was
// measured; the limits are looser.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <map>
#include <string>

#include "ingest/objects/registration/feature_match.h"
#include "tests/unit/ingest/objects/registration/cloud_files.h"
#include "tests/unit/schema/matching/registration_test_util.h"

namespace dsg::ingest {
namespace {

constexpr char kMissing[] = "the recorded clouds are not there; set DSG_DATA";

// For the printed figures only.
class Stopwatch {
 public:
  double Ms() const {
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - begin_;
    return passed.count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// The share of points with a point of the cloud within a radius.
class NearShare {
 public:
  NearShare(const std::vector<Eigen::Vector3d>& cloud, double radius_m) : radius_m_(radius_m) {
    for (const Eigen::Vector3d& point : cloud) cubes_[CubeOf(point)].push_back(point);
  }

  bool HasNear(const Eigen::Vector3d& point) const {
    const std::array<int, 3> middle = CubeOf(point);
    for (int i = 0; i < 27; ++i) {
      const auto cube =
          cubes_.find({middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1});
      if (cube == cubes_.end()) continue;
      for (const Eigen::Vector3d& other : cube->second) {
        if ((other - point).norm() <= radius_m_) return true;
      }
    }
    return false;
  }

  double Of(const std::vector<Eigen::Vector3d>& points, const Registration& motion) const {
    int near_count = 0;
    for (const Eigen::Vector3d& point : points) {
      if (HasNear(motion * point)) ++near_count;
    }
    return points.empty() ? 0.0 : 1.0 * near_count / static_cast<double>(points.size());
  }

 private:
  std::array<int, 3> CubeOf(const Eigen::Vector3d& point) const {
    const Eigen::Vector3i cube = (point / radius_m_).array().floor().matrix().cast<int>();
    return {cube.x(), cube.y(), cube.z()};
  }

  double radius_m_;
  std::map<std::array<int, 3>, std::vector<Eigen::Vector3d>> cubes_;
};

void Print(const char* what, const absl::StatusOr<Registration>& found, size_t pair_count,
           double ms) {
  if (!found.ok()) {
    std::printf("%s: %s\n", what, std::string(found.status().message()).c_str());
    return;
  }
  std::printf("%s: %zu inliers of %zu pairs, clique %d (%s), residual %.4f m, solved in %.0f ms\n",
              what, found->inliers.size(), pair_count, found->clique_size,
              found->is_clique_maximal ? "exact" : "cut off", found->residual_m, ms);
}

class BenchmarkTest : public testing::TestWithParam<int> {};

TEST_P(BenchmarkTest, IsReproducedScaleIncluded) {
  const std::string folder = "teaser_benchmark_" + std::to_string(GetParam()) + "/";
  if (RegistrationFile(folder).empty()) GTEST_SKIP() << kMissing;
  const auto source = ReadPlyPoints(RegistrationFile(folder + "src.ply"));
  const auto target = ReadPlyPoints(RegistrationFile(folder + "dst.ply"));
  const auto rotation = ReadNumbers(RegistrationFile(folder + "R_ref.csv"));
  const auto translation = ReadNumbers(RegistrationFile(folder + "t_ref.csv"));
  const auto scale = ReadNumbers(RegistrationFile(folder + "s_ref.csv"));
  ASSERT_EQ(source.size(), target.size());
  ASSERT_EQ(rotation.size(), 9U);
  ASSERT_EQ(translation.size(), 3U);
  ASSERT_EQ(scale.size(), 1U);
  KnownMotion truth;
  truth.scale = scale[0];
  truth.rotation = Eigen::Map<const Eigen::Matrix3d>(rotation.data()).transpose();
  truth.translation = Eigen::Map<const Eigen::Vector3d>(translation.data());
  std::vector<Correspondence> pairs;
  for (int i = 0; i < static_cast<int>(source.size()); ++i) pairs.emplace_back(i, i);
  const auto found =
      Register(source, target, pairs, {.noise_bound_m = 1e-4, .estimate_scale = true});
  ASSERT_TRUE(found.ok()) << found.status();
  std::printf("benchmark %d: %zu of %zu are inliers; %.1e deg, %.1e m, scale %.1e\n", GetParam(),
              found->inliers.size(), source.size(), RotationErrorDeg(*found, truth),
              TranslationErrorM(*found, truth), std::abs(found->scale - truth.scale));
  EXPECT_LT(RotationErrorDeg(*found, truth), 1e-4);
  EXPECT_LT(TranslationErrorM(*found, truth), 1e-6);
  EXPECT_NEAR(found->scale, truth.scale, 1e-6);
  const double share =
      1.0 * static_cast<double>(found->inliers.size()) / static_cast<double>(source.size());
  constexpr double kInlierShares[] = {1.0, 0.9, 0.7, 0.5};
  EXPECT_NEAR(share, kInlierShares[GetParam() - 1], 1e-9);
}

INSTANTIATE_TEST_SUITE_P(All, BenchmarkTest, testing::Range(1, 5));

struct BunnyKind {
  double size_m;
  double noise_m;
  double noise_bound_m;
  // 0 puts wrong targets among the right ones.
  double outlier_offset_m;
};

// 1889 vertices, each with its own image, 1700 of which are then moved away.
Clouds BunnyClouds(std::vector<Eigen::Vector3d> model, const BunnyKind& kind, Random* random) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : model) box.extend(point);
  for (Eigen::Vector3d& point : model) {
    point = (point - box.min()) * (kind.size_m / box.sizes().maxCoeff());
  }
  Clouds clouds;
  clouds.source = model;
  clouds.truth.rotation = RandomRotation(random);
  clouds.truth.translation = RandomInBall(random, 1.0);
  for (int i = 0; i < static_cast<int>(model.size()); ++i) {
    const Eigen::Vector3d noise =
        2.0 * RandomInCube(random, kind.noise_m) - Eigen::Vector3d::Constant(kind.noise_m);
    clouds.target.push_back(clouds.truth * model[i] + noise);
    clouds.correspondences.emplace_back(i, i);
  }
  for (int i = 0; i < 1700; ++i) {
    // A tenth of the vertices stays right: which ones is drawn as in shuffling.
    std::swap(clouds.correspondences[i],
              clouds.correspondences[random->Integer(i, static_cast<int>(model.size()) - 1)]);
    Eigen::Vector3d& wrong = clouds.target[clouds.correspondences[i].second];
    if (kind.outlier_offset_m > 0.0) {
      const Eigen::Vector3d away = RandomNormal(random, 1.0).normalized();
      wrong += random->Uniform(kind.outlier_offset_m, 2.0 * kind.outlier_offset_m) * away;
    } else {
      wrong = clouds.truth * RandomInCube(random, kind.size_m);
    }
  }
  return clouds;
}

void SolveBunny(const char* what, const BunnyKind& kind) {
  const std::string path = RegistrationFile("bunny/bun_zipper_res3.ply");
  if (path.empty()) GTEST_SKIP() << kMissing;
  const auto model = ReadPlyPoints(path);
  ASSERT_EQ(model.size(), 1889U);
  Random random(61, 0);
  std::vector<double> rotation_errors_deg;
  std::vector<double> translation_errors_m;
  std::vector<double> times_ms;
  int exact_count = 0;
  for (int draw = 0; draw < 20; ++draw) {
    const Clouds clouds = BunnyClouds(model, kind, &random);
    const Stopwatch watch;
    const auto found = Register(clouds.source, clouds.target, clouds.correspondences,
                                {.noise_bound_m = kind.noise_bound_m});
    times_ms.push_back(watch.Ms());
    ASSERT_TRUE(found.ok()) << "seed 61, draw " << draw << ": " << found.status();
    rotation_errors_deg.push_back(RotationErrorDeg(*found, clouds.truth));
    translation_errors_m.push_back(TranslationErrorM(*found, clouds.truth));
    EXPECT_LT(rotation_errors_deg.back(), 1.0) << "seed 61, draw " << draw;
    if (found->is_clique_maximal) ++exact_count;
  }
  std::printf(
      "bunny, %s: median of 20 %.3f deg, %.2f mm, %.0f ms; worst %.3f deg; %d exact\n", what,
      Median(rotation_errors_deg), 1e3 * Median(translation_errors_m), Median(times_ms),
      *std::max_element(rotation_errors_deg.begin(), rotation_errors_deg.end()), exact_count);
}

TEST(Bunny, IsFoundAmongNinetyPerCentFarWrongPairs) {
  SolveBunny("0.25 m, noise 1 mm, wrong ones 5 to 10 m away", {0.25, 0.001, 0.002, 5.0});
}

TEST(Bunny, IsFoundAmongNinetyPerCentWrongPairsWithinIt) {
  SolveBunny("1 m, noise 10 mm, wrong ones within the cube", {1.0, 0.01, 0.018, 0.0});
}

std::vector<Correspondence> MatchClouds(const std::vector<Eigen::Vector3d>& source,
                                        const std::vector<Eigen::Vector3d>& target,
                                        const FeatureOptions& options,
                                        std::vector<Eigen::Vector3d>* source_points,
                                        std::vector<Eigen::Vector3d>* target_points) {
  const Stopwatch watch;
  const auto a = DescribeCloud(source, options);
  const auto b = DescribeCloud(target, options);
  EXPECT_TRUE(a.ok()) << a.status();
  EXPECT_TRUE(b.ok()) << b.status();
  if (!a.ok() || !b.ok()) return {};
  const double describe_ms = watch.Ms();
  *source_points = a->points;
  *target_points = b->points;
  auto matches = MatchMutually(*a, *b, 4000);
  std::printf("%zu and %zu points described in %.0f ms, matched in %.0f ms\n", a->points.size(),
              b->points.size(), describe_ms, watch.Ms() - describe_ms);
  return matches;
}

TEST(RedKitchen, IsPutTogetherFromTwoRealFragments) {
  const std::string path = RegistrationFile("redkitchen/cloud_bin_0_2cm.ply");
  if (path.empty()) GTEST_SKIP() << kMissing;
  const auto target = ReadPlyPoints(path);
  const auto source = ReadPlyPoints(RegistrationFile("redkitchen/cloud_bin_4_2cm.ply"));
  ASSERT_EQ(target.size(), 28793U);
  ASSERT_EQ(source.size(), 30321U);
  const auto numbers = ReadNumbers(RegistrationFile("redkitchen/T_0_4.txt"));
  ASSERT_EQ(numbers.size(), 16U);
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(numbers.data()).transpose();
  KnownMotion truth;
  truth.rotation = matrix.topLeftCorner<3, 3>();
  truth.translation = matrix.topRightCorner<3, 1>();
  std::vector<Eigen::Vector3d> source_points;
  std::vector<Eigen::Vector3d> target_points;
  const auto pairs = MatchClouds(source, target, {}, &source_points, &target_points);
  int right_count = 0;
  for (const auto& [from, to] : pairs) {
    if ((truth * source_points[from] - target_points[to]).norm() < 0.08) ++right_count;
  }
  std::printf("%d of %zu matches within 8 cm\n", right_count, pairs.size());
  const Stopwatch watch;
  const auto found = Register(source_points, target_points, pairs, {.noise_bound_m = 0.05});
  Print("red kitchen", found, pairs.size(), watch.Ms());
  ASSERT_TRUE(found.ok());
  const double rotation_error_deg = RotationErrorDeg(*found, truth);
  const double translation_error_m = TranslationErrorM(*found, truth);
  const double share = NearShare(target, 0.03).Of(source, *found);
  std::printf("red kitchen: %.2f deg, %.3f m; %.0f %% of the points within 3 cm\n",
              rotation_error_deg, translation_error_m, 100.0 * share);
  EXPECT_LT(rotation_error_deg, 4.0);
  EXPECT_LT(translation_error_m, 0.15);
  EXPECT_GT(share, 0.35);
}

// The model was cut out of this very scene, so it is moved, thinned by half and shaken first; the
// motion back is then known.
TEST(Milk, IsFoundInTheClutter) {
  const std::string path = RegistrationFile("milk_clutter/milk.pcd");
  if (path.empty()) GTEST_SKIP() << kMissing;
  const auto model = ReadPcdPoints(path);
  const auto scene =
      ReadPcdPoints(RegistrationFile("milk_clutter/milk_cartoon_all_small_clorox.pcd"));
  ASSERT_EQ(model.size(), 13704U);
  ASSERT_GT(scene.size(), 100'000U);
  FeatureOptions options = {.spacing_m = 0.01, .normal_radius_m = 0.025, .feature_radius_m = 0.05};
  const auto described = DescribeCloud(scene, options);
  ASSERT_TRUE(described.ok()) << described.status();
  const NearShare near_scene(scene, 0.01);
  Random random(62, 0);
  for (int draw = 0; draw < 5; ++draw) {
    KnownMotion away;
    away.rotation = RandomRotation(&random);
    away.translation = RandomInBall(&random, 1.0);
    std::vector<Eigen::Vector3d> moved;
    for (size_t i = 0; i < model.size(); i += 2) {
      moved.push_back(away * model[i] + RandomNormal(&random, 0.001));
    }
    // A model knows its outside, which here is the side that the camera saw.
    options.viewpoint = away.translation;
    const auto features = DescribeCloud(moved, options);
    ASSERT_TRUE(features.ok()) << features.status();
    const auto pairs = MatchMutually(*features, *described, 4000);
    const Stopwatch watch;
    const auto found =
        Register(features->points, described->points, pairs, {.noise_bound_m = 0.01});
    Print("milk", found, pairs.size(), watch.Ms());
    ASSERT_TRUE(found.ok()) << "seed 62, draw " << draw << ": " << found.status();
    KnownMotion truth;
    truth.rotation = away.rotation.transpose();
    truth.translation = -(truth.rotation * away.translation);
    const Eigen::Vector3d middle = moved[moved.size() / 2];
    const double share = near_scene.Of(moved, *found);
    std::printf("milk: %.2f deg, %.1f mm; %.0f %% of the model within 1 cm of the scene\n",
                RotationErrorDeg(*found, truth), 1e3 * (*found * middle - truth * middle).norm(),
                100.0 * share);
    EXPECT_LT(RotationErrorDeg(*found, truth), 5.0) << "seed 62, draw " << draw;
    EXPECT_LT((*found * middle - truth * middle).norm(), 0.01) << "seed 62, draw " << draw;
    EXPECT_GT(share, 0.9) << "seed 62, draw " << draw;
  }
}

TEST(BunnyViews, OverlapOnceTheyArePutTogether) {
  const std::string path = RegistrationFile("bunny/bun0.pcd");
  if (path.empty()) GTEST_SKIP() << kMissing;
  const auto target = ReadPcdPoints(path);
  const auto source = ReadPcdPoints(RegistrationFile("bunny/bun4.pcd"));
  ASSERT_EQ(target.size(), 397U);
  ASSERT_EQ(source.size(), 361U);
  const FeatureOptions options = {.spacing_m = 0.004,
                                  .normal_radius_m = 0.015,
                                  .feature_radius_m = 0.03,
                                  .viewpoint = {0.0, 0.1, 1.0}};
  std::vector<Eigen::Vector3d> source_points;
  std::vector<Eigen::Vector3d> target_points;
  const auto pairs = MatchClouds(source, target, options, &source_points, &target_points);
  const Stopwatch watch;
  const auto found = Register(source_points, target_points, pairs, {.noise_bound_m = 0.005});
  Print("bunny views", found, pairs.size(), watch.Ms());
  ASSERT_TRUE(found.ok());
  const double share = NearShare(target, 0.006).Of(source, *found);
  std::printf("bunny views: turned by %.1f deg, %.0f %% within 6 mm\n",
              Eigen::AngleAxisd(found->rotation).angle() * kRadianDeg, 100.0 * share);
  EXPECT_GT(share, 0.6);
}

}  // namespace
}  // namespace dsg::ingest
