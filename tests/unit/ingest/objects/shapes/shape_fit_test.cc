// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/shape_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "ingest/simulator/scene/scene.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/objects/shapes/shape_views.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

constexpr int kTrialCount = 50;
// Of the questions that are not about numbers.
constexpr int kFewTrialCount = 20;

ingest::CadModel SimulatorCouch() {
  const simulator::TriangleMesh mesh = simulator::CadModel("couch", {1.9, 0.85, 0.8});
  CadModel model;
  model.class_name = "couch";
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    model.vertices.push_back(vertex.cast<double>());
  }
  model.faces = mesh.faces;
  return model;
}

// Errors of many fits.
struct Statistics {
  std::vector<double> distances_m;
  std::vector<double> angles_deg;
  double seconds = 0.0;
  int fit_count = 0;
  int trial_count = 0;

  void Add(const std::optional<ShapeFit>& fit, const Pose3d& truth, double fit_seconds) {
    ++trial_count;
    seconds += fit_seconds;
    if (!fit) return;
    ++fit_count;
    distances_m.push_back((fit->map_T_model.position - truth.position).norm());
    angles_deg.push_back(YawErrorDeg(fit->map_T_model, truth));
  }
  // Share of all trials within both bounds.
  double ShareWithin(double distance_m, double angle_deg) const {
    int count = 0;
    for (size_t i = 0; i < distances_m.size(); ++i) {
      if (distances_m[i] <= distance_m && angles_deg[i] <= angle_deg) ++count;
    }
    return static_cast<double>(count) / trial_count;
  }
  static double Median(std::vector<double> values) {
    if (values.empty()) return -1.0;
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  }
  void Print(const char* what) const {
    std::printf(
        "%s: %d of %d fitted, median %.3f m %.2f deg, worst %.3f m %.1f deg, within 0.20 m and "
        "10 deg %.0f %%, within 0.08 m and 4 deg %.0f %%, %.0f ms of processor each\n",
        what, fit_count, trial_count, Median(distances_m), Median(angles_deg),
        distances_m.empty() ? -1.0 : *std::max_element(distances_m.begin(), distances_m.end()),
        angles_deg.empty() ? -1.0 : *std::max_element(angles_deg.begin(), angles_deg.end()),
        100.0 * ShareWithin(0.2, 10.0), 100.0 * ShareWithin(0.08, 4.0),
        1000.0 * seconds / trial_count);
  }
};

// Any side but from straight behind, where a couch is a wall.
double RandomAzimuth(Random* random) { return random->Uniform(-0.75, 0.75) * std::numbers::pi; }

struct Trials {
  ViewOptions view;
  bool has_floor = false;
  bool has_free_test = true;
  bool is_half = false;
  bool is_paper = false;
  bool is_upright = true;
  int count = kTrialCount;
};

Statistics RunTrials(const CadModel& model, const Trials& trials, uint64_t seed) {
  Random random(seed, 1);
  ShapeOptions options;
  options.is_paper = trials.is_paper;
  // Its poses stay, however little of the object they explain.
  if (trials.is_paper) options.inlier_share_min = 1.0;
  options.is_upright = trials.is_upright;
  const ShapeFitter fitter({model}, options);
  Statistics statistics;
  for (int i = 0; i < trials.count; ++i) {
    const Pose3d truth = RandomPose(&random);
    const Vector3d eye = EyeAround(truth, RandomAzimuth(&random), random.Uniform(1.8, 3.0));
    ShapeView view(model, truth, {eye}, trials.view, &random);
    const double side = random.Chance(0.5) ? 1.0 : -1.0;
    if (trials.is_half) {
      view.Keep([side](const Vector3d& point) { return side * point.x() > -0.1; });
    }
    const auto is_free = [&](const Vector3d& point) { return view.IsFree(point); };
    const std::optional<double> floor =
        trials.has_floor ? std::optional<double>(truth.position.z()) : std::nullopt;
    const std::clock_t begin = std::clock();
    const std::optional<ShapeFit> fit =
        trials.has_free_test ? fitter.Fit("couch", view.points_map(), is_free, floor)
                             : fitter.Fit("couch", view.points_map(), nullptr, floor);
    statistics.Add(fit, truth, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return statistics;
}

TEST(ShapeFit, FindsACouchSeenFromOneSide) {
  const uint64_t seed = test::TestSeed(11);
  const Statistics statistics = RunTrials(BoxCouch(), {}, seed);
  statistics.Print("box couch, 5 cm voxels");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
  EXPECT_GE(statistics.ShareWithin(0.08, 4.0), 0.9);
}

TEST(ShapeFit, FindsACouchInCoarseVoxelsWithPiecesOfWallAndFloor) {
  const uint64_t seed = test::TestSeed(12);
  Trials trials;
  trials.view = {.voxel_m = 0.1, .noise_m = 0.025, .inflation_m = 0.04, .stray_share = 0.15};
  trials.count = kFewTrialCount;
  const Statistics statistics = RunTrials(BoxCouch(), trials, seed);
  statistics.Print("box couch, 10 cm voxels, 15 % stray");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
}

TEST(ShapeFit, FindsTheSimulatorsCouch) {
  const uint64_t seed = test::TestSeed(13);
  Trials trials;
  trials.view.stray_share = 0.05;
  trials.count = kFewTrialCount;
  const Statistics statistics = RunTrials(SimulatorCouch(), trials, seed);
  statistics.Print("simulator's couch, 5 cm voxels");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
  EXPECT_GE(statistics.ShareWithin(0.08, 4.0), 0.9);
}

TEST(ShapeFit, FindsTheSimulatorsCouchInCoarseVoxelsOnAKnownFloor) {
  const uint64_t seed = test::TestSeed(14);
  Trials trials;
  trials.view = {.voxel_m = 0.1, .noise_m = 0.025, .inflation_m = 0.04, .stray_share = 0.05};
  trials.has_floor = true;
  const Statistics statistics = RunTrials(SimulatorCouch(), trials, seed);
  statistics.Print("simulator's couch, 10 cm voxels, floor known");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
}

TEST(ShapeFit, FindsACouchOfWhichHalfWasSeen) {
  const uint64_t seed = test::TestSeed(15);
  Trials trials;
  trials.is_half = true;
  trials.count = kFewTrialCount;
  const Statistics statistics = RunTrials(SimulatorCouch(), trials, seed);
  statistics.Print("half of the simulator's couch");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
}

TEST(ShapeFit, LetsGoOfATableThatBledIntoTheCouch) {
  Random random(test::TestSeed(23), 1);
  const CadModel couch = SimulatorCouch();
  const ShapeFitter fitter({couch}, {});
  Statistics statistics;
  for (int i = 0; i < kFewTrialCount; ++i) {
    const Pose3d truth = RandomPose(&random);
    const ViewOptions coarse{.voxel_m = 0.1};
    const ShapeView view(couch, truth, {EyeAround(truth, random.Uniform(-0.8, 0.8), 2.5)}, coarse,
                         &random);
    std::vector<Eigen::Vector3f> points = view.points_map();
    // Its top and the near edge of it, a quarter of all points.
    const double left = random.Uniform(-0.8, -0.2);
    for (size_t k = points.size() / 3; k > 0; --k) {
      const Vector3d table(left + random.Uniform(0.0, 1.0), random.Uniform(0.48, 0.9),
                           random.Chance(0.8) ? 0.38 : random.Uniform(0.1, 0.38));
      points.push_back((truth * table).cast<float>());
    }
    const auto is_free = [&](const Vector3d& point) { return view.IsFree(point); };
    const std::clock_t begin = std::clock();
    const auto fit = fitter.Fit("couch", points, is_free);
    statistics.Add(fit, truth, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  statistics.Print("table before the simulator's couch, 10 cm voxels");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
  EXPECT_GE(statistics.ShareWithin(0.08, 4.0), 0.9);
}

TEST(ShapeFit, FindsACouchWithoutFreeSpaceOrGravity) {
  const uint64_t seed = test::TestSeed(16);
  Trials trials;
  trials.has_free_test = false;
  trials.is_upright = false;
  trials.count = kFewTrialCount;
  const Statistics statistics = RunTrials(SimulatorCouch(), trials, seed);
  statistics.Print("no gravity, no free space");
  EXPECT_GE(statistics.ShareWithin(0.2, 10.0), 0.9);
}

TEST(ShapeFit, ThePapersStepsAloneFindSomeCouches) {
  const uint64_t seed = test::TestSeed(17);
  Trials trials;
  trials.is_paper = true;
  trials.count = kFewTrialCount;
  const Statistics statistics = RunTrials(SimulatorCouch(), trials, seed);
  statistics.Print("paper's steps");
  EXPECT_GT(statistics.fit_count, kFewTrialCount / 2);
}

TEST(ShapeFit, TellsFrontFromBackByTheSpaceThatWasSeenToBeFree) {
  Random random(test::TestSeed(18), 1);
  // A bench with a thin back, of which only the upper part of the back was seen, from behind.
  const CadModel model =
      BoxModel("bench", {{Vector3d(-0.9, -0.4, 0.0), Vector3d(0.9, 0.4, 0.4)},
                         {Vector3d(-0.9, -0.4, 0.0), Vector3d(0.9, -0.36, 0.85)}});
  const ShapeFitter fitter({model}, {});
  int right_count = 0;
  int blind_count = 0;
  for (int i = 0; i < kTrialCount; ++i) {
    const Pose3d truth = RandomPose(&random);
    const Vector3d eye =
        EyeAround(truth, std::numbers::pi + random.Uniform(-0.5, 0.5), random.Uniform(1.8, 3.0));
    ShapeView view(model, truth, {eye}, {}, &random);
    view.Keep([](const Vector3d& point) { return point.z() > 0.45; });
    const auto is_free = [&](const Vector3d& point) { return view.IsFree(point); };
    const double floor = truth.position.z();
    const auto fit = fitter.Fit("bench", view.points_map(), is_free, floor);
    if (fit && YawErrorDeg(fit->map_T_model, truth) < 20.0) ++right_count;
    if (i >= kFewTrialCount) continue;
    const auto blind = fitter.Fit("bench", view.points_map(), nullptr, floor);
    if (blind && YawErrorDeg(blind->map_T_model, truth) < 20.0) ++blind_count;
  }
  std::printf("front and back told apart: %d of %d, without free space %d of %d\n", right_count,
              kTrialCount, blind_count, kFewTrialCount);
  EXPECT_GE(right_count, 0.95 * kTrialCount);
  // Otherwise the test would show nothing.
  EXPECT_LT(blind_count, 0.9 * kFewTrialCount);
}

TEST(ShapeFit, RefusesAWardrobeAsACouch) {
  Random random(test::TestSeed(19), 1);
  const CadModel wardrobe =
      BoxModel("wardrobe", {{Vector3d(-0.5, -0.3, 0.0), Vector3d(0.5, 0.3, 2.0)}});
  const ShapeFitter fitter({SimulatorCouch()}, {});
  for (int i = 0; i < kFewTrialCount; ++i) {
    const Pose3d truth = RandomPose(&random);
    const Vector3d eye = EyeAround(truth, random.Uniform(-3.1, 3.1), 2.5);
    const ShapeView view(wardrobe, truth, {eye}, {}, &random);
    const auto is_free = [&](const Vector3d& point) { return view.IsFree(point); };
    const auto fit = fitter.Fit("couch", view.points_map(), is_free);
    EXPECT_FALSE(fit.has_value()) << "trial " << i << ", inliers " << fit->inlier_share;
  }
}

TEST(ShapeFit, PicksTheRightSizeAmongTheModelsOfAClass) {
  Random random(test::TestSeed(20), 1);
  const auto sofa = [](double half) {
    return BoxModel("couch", {{Vector3d(-half, -0.4, 0.0), Vector3d(half, 0.4, 0.4)},
                              {Vector3d(-half, -0.4, 0.0), Vector3d(half, -0.2, 0.8)},
                              {Vector3d(-half, -0.4, 0.0), Vector3d(-half + 0.2, 0.4, 0.6)},
                              {Vector3d(half - 0.2, -0.4, 0.0), Vector3d(half, 0.4, 0.6)}});
  };
  const std::vector<CadModel> catalogue = {sofa(0.5), sofa(0.8), sofa(1.1)};
  const ShapeFitter fitter(catalogue, {});
  int right_count = 0;
  for (int i = 0; i < 15; ++i) {
    const Pose3d truth = RandomPose(&random);
    const Vector3d eye = EyeAround(truth, random.Uniform(-1.0, 1.0), 2.5);
    const ShapeView view(catalogue[static_cast<size_t>(i % 3)], truth, {eye}, {}, &random);
    const auto is_free = [&](const Vector3d& point) { return view.IsFree(point); };
    const auto fit = fitter.Fit("Couch", view.points_map(), is_free);
    if (fit && fit->model == i % 3) ++right_count;
  }
  std::printf("right size: %d of 15\n", right_count);
  EXPECT_GE(right_count, 14);
}

TEST(ShapeFit, KeepsQuietAboutClassesAndPointsItCannotFit) {
  const ShapeFitter fitter({BoxCouch()}, {});
  Random random(21, 1);
  const ShapeView view(BoxCouch(), {}, {Vector3d(0.0, 2.5, 1.3)}, {}, &random);
  EXPECT_FALSE(fitter.Fit("chair", view.points_map(), nullptr));
  EXPECT_FALSE(fitter.Fit("couch", {}, nullptr));
  EXPECT_FALSE(fitter.Fit("couch", {{0.0f, 0.0f, 0.0f}}, nullptr));
  const std::vector<Eigen::Vector3f> one_place(500, Eigen::Vector3f(1.0f, 2.0f, 3.0f));
  EXPECT_FALSE(fitter.Fit("couch", one_place, nullptr));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Eigen::Vector3f> dirty = view.points_map();
  dirty.insert(dirty.begin(), {{nan, 0.0f, 0.0f}, {1e30f, 0.0f, 0.0f}, {0.0f, -1e9f, nan}});
  const auto fit = fitter.Fit("couch", dirty, nullptr);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->map_T_model.position.norm(), 0.1);
}

// Away from its default each number of the search makes another fit, or none.
TEST(ShapeFit, ReadsTheNumbersOfItsSearch) {
  Random random(24, 1);
  const CadModel couch = SimulatorCouch();
  const Pose3d truth = RandomPose(&random);
  const ViewOptions coarse{
      .voxel_m = 0.1, .noise_m = 0.025, .inflation_m = 0.04, .stray_share = 0.15};
  const ShapeView view(couch, truth, {EyeAround(truth, 0.5, 2.2)}, coarse, &random);
  const auto fit_with = [&](ShapeOptions options, bool has_few_starts) {
    if (has_few_starts) options.start_count = options.shaken_count = 1;
    return ShapeFitter({couch}, options).Fit("couch", view.points_map(), nullptr);
  };
  const auto differ = [](const std::optional<ShapeFit>& a, const std::optional<ShapeFit>& b) {
    if (!a || !b) return a.has_value() != b.has_value();
    return a->map_T_model.position != b->map_T_model.position || a->residual_m != b->residual_m ||
           a->inlier_share != b->inlier_share;
  };
  const std::optional<ShapeFit> usual[] = {fit_with({}, false), fit_with({}, true)};
  EXPECT_TRUE(usual[0].has_value());
  ShapeOptions options;
  const std::vector<BoundOption> all = options.Bind();
  for (const auto& [name, number] :
       std::vector<std::pair<std::string, double>>{{"shape-slide", 0.0},
                                                   {"shape-rough-steps", 1},
                                                   {"shape-rough-far", 0.05},
                                                   {"shape-rough-near", 0.3},
                                                   {"shape-kept-far", 0.4},
                                                   {"shape-kept-near", 0.02},
                                                   {"shape-exact-steps", 1},
                                                   {"shape-exact-near", 0.02},
                                                   {"shape-points-min", 100'000},
                                                   {"shape-points", 100},
                                                   {"shape-rough-points", 20},
                                                   {"shape-surface", 0.1},
                                                   {"shape-turns", 5},
                                                   {"shape-look-near", 0.05},
                                                   {"shape-look-points", 10},
                                                   {"shape-trim", 0.3},
                                                   {"shape-candidates", 1}}) {
    const auto field = std::find_if(all.begin(), all.end(), [&name = name](const BoundOption& one) {
      return one.name == name;
    });
    ASSERT_NE(field, all.end()) << name;
    const double before = field->Get();
    field->Set(number);
    EXPECT_TRUE(ValidateOptions(options).ok()) << name;
    EXPECT_TRUE(differ(fit_with(options, false), usual[0]) ||
                differ(fit_with(options, true), usual[1]))
        << name;
    field->Set(before);
  }
}

TEST(ShapeFit, GivesTheSameFitForTheSamePoints) {
  Random random(22, 1);
  const Pose3d truth = RandomPose(&random);
  const ShapeView view(SimulatorCouch(), truth, {EyeAround(truth, 0.4, 2.5)}, {}, &random);
  const ShapeFitter first({SimulatorCouch()}, {});
  const ShapeFitter second({SimulatorCouch()}, {});
  const auto a = first.Fit("couch", view.points_map(), nullptr);
  const auto b = second.Fit("couch", view.points_map(), nullptr);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->map_T_model.position, b->map_T_model.position);
  EXPECT_EQ(a->map_T_model.orientation.coeffs(), b->map_T_model.orientation.coeffs());
  EXPECT_EQ(a->residual_m, b->residual_m);
}

}  // namespace
}  // namespace dsg::ingest
