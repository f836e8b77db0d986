// SPDX-License-Identifier: Apache-2.0
// Constant velocity on recorded pedestrians, by the window rule of the literature.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>

#include "tests/unit/query/prediction/pedestrian_files.h"

namespace dsg::query {
namespace {

std::string DataFolder() {
  const char* folder = std::getenv("DSG_DATA");
  const std::string data = folder != nullptr ? folder : DSG_SOURCE_DIR "/../shared/data";
  return data + "/people-eth-ucy/";
}

void PrintScores(const std::string& name, const WindowScore& last, const WindowScore& weighted,
                 const WindowScore& adaptive) {
  std::cout << std::fixed << std::setprecision(3) << std::left << std::setw(14) << name
            << " last step " << last.ade_m << " / " << last.fde_m << "  weighted " << weighted.ade_m
            << " / " << weighted.fde_m << "  adaptive " << adaptive.ade_m << " / " << adaptive.fde_m
            << "  " << last.window_count << " windows\n";
}

WindowScore Scored(const Pedestrians& pedestrians, int64_t frame_step, const Predictor& predictor) {
  WindowScore sums;
  ScoreWindows(pedestrians, frame_step, predictor, &sums);
  return Means(sums);
}

struct Scene {
  const char* file;
  int x_column;
  int y_column;
  int64_t frame_step;
  WindowScore expected;
};

class RecordedScene : public testing::TestWithParam<Scene> {};

TEST_P(RecordedScene, IsPredictedAsWellAsComputedElsewhere) {
  const Scene& scene = GetParam();
  const Pedestrians pedestrians =
      ReadPedestrians(DataFolder() + scene.file, scene.x_column, scene.y_column);
  if (pedestrians.empty()) GTEST_SKIP() << "the recorded pedestrians are not there; set DSG_DATA";
  const WindowScore last = Scored(pedestrians, scene.frame_step, LastStep());
  PrintScores(scene.file, last, Scored(pedestrians, scene.frame_step, Weighted()),
              Scored(pedestrians, scene.frame_step, Adaptive({})));
  EXPECT_EQ(last.window_count, scene.expected.window_count);
  EXPECT_NEAR(last.ade_m, scene.expected.ade_m, 1e-3);
  EXPECT_NEAR(last.fde_m, scene.expected.fde_m, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    All, RecordedScene,
    testing::Values(Scene{"eth/obsmat.txt", 2, 4, 6, {0.678, 1.344, 2614}},
                    Scene{"zara01/obsmat.txt", 2, 4, 10, {0.449, 0.999, 2234}},
                    Scene{"zara03/crowds_zara03.txt", 2, 3, 10, {0.464, 1.054, 2488}},
                    Scene{"students003/students003.txt", 2, 3, 10, {0.618, 1.369, 10039}}),
    [](const testing::TestParamInfo<Scene>& scene) {
      const std::string file = scene.param.file;
      return file.substr(0, file.find('/'));
    });

// The literature's file of this scene takes every tenth frame number, though its people were marked
// every sixth: 0.67 s are called 0.4 s, which is why ETH is the hardest column of all tables.
TEST(PublishedRow, OfEthFollowsFromTheAuthorsOwnFile) {
  const Pedestrians authors = ReadPedestrians(DataFolder() + "eth/obsmat.txt", 2, 4);
  if (authors.empty()) GTEST_SKIP() << "the recorded pedestrians are not there; set DSG_DATA";
  const Pedestrians pedestrians = Resample(authors, 10);
  const WindowScore last = Scored(pedestrians, 10, LastStep());
  PrintScores("eth by tens", last, Scored(pedestrians, 10, Weighted()),
              Scored(pedestrians, 10, Adaptive({})));
  EXPECT_EQ(last.window_count, 364);
  EXPECT_NEAR(last.ade_m, 1.075, 1e-3);
  EXPECT_NEAR(last.fde_m, 2.282, 1e-3);
}

/// Of a table's column: all its files, in frames of ten.
struct Column {
  std::string name;
  std::vector<Pedestrians> files;
};

WindowScore ScoredColumn(const Column& column, const Predictor& predictor) {
  WindowScore sums;
  for (const Pedestrians& file : column.files) ScoreWindows(file, 10, predictor, &sums);
  return Means(sums);
}

std::vector<WeightedVelocityOptions> AllOptions() {
  std::vector<WeightedVelocityOptions> all;
  for (const double decay_noisy : {0.4, 0.5, 0.6}) {
    for (const double damping_steady : {0.98, 0.99, 1.0}) {
      for (const double damping_noisy : {0.96, 0.97, 0.98, 0.99}) {
        if (damping_noisy > damping_steady) continue;
        all.push_back({0.05, decay_noisy, damping_steady, damping_noisy});
      }
    }
  }
  return all;
}

/// Each column with the options that are best for the others; the means over the columns.
WindowScore LeaveOneOut(const std::vector<Column>& columns) {
  const std::vector<WeightedVelocityOptions> all = AllOptions();
  std::vector<std::vector<WindowScore>> scores;
  for (const WeightedVelocityOptions& options : all) {
    std::vector<WindowScore> row;
    for (const Column& column : columns) row.push_back(ScoredColumn(column, Adaptive(options)));
    scores.push_back(row);
  }
  WindowScore mean;
  for (size_t left_out = 0; left_out < columns.size(); ++left_out) {
    const auto others = [&](const std::vector<WindowScore>& row) {
      double sum_m = 0.0;
      for (size_t i = 0; i < row.size(); ++i) {
        if (i != left_out) sum_m += 2.0 * row[i].ade_m + row[i].fde_m;
      }
      return sum_m;
    };
    const auto best =
        std::min_element(scores.begin(), scores.end(),
                         [&](const auto& a, const auto& b) { return others(a) < others(b); });
    const WeightedVelocityOptions& options = all[static_cast<size_t>(best - scores.begin())];
    const WindowScore& score = (*best)[left_out];
    std::cout << "  " << std::setw(12) << columns[left_out].name << score.ade_m << " / "
              << score.fde_m << "  by decay " << options.decay_noisy << ", damping "
              << options.damping_steady << " to " << options.damping_noisy << "\n";
    mean.ade_m += score.ade_m / static_cast<double>(columns.size());
    mean.fde_m += score.fde_m / static_cast<double>(columns.size());
  }
  std::cout << "  mean        " << mean.ade_m << " / " << mean.fde_m << "\n";
  return mean;
}

WindowScore MeanOf(const std::vector<Column>& columns, const Predictor& predictor) {
  WindowScore mean;
  for (const Column& column : columns) {
    const WindowScore score = ScoredColumn(column, predictor);
    mean.ade_m += score.ade_m / static_cast<double>(columns.size());
    mean.fde_m += score.fde_m / static_cast<double>(columns.size());
  }
  return mean;
}

// Four of the literature's scenes, or such as are like them: the others are not at hand. The target
// over the literature's five is that of Weighted(), which was tuned on all of them.
TEST(Adaptive, IsBetterThanWhatWasTunedOnTheScenesThoughTunedOnTheOthersAlone) {
  const auto read = [](const char* file, int x_column, int y_column) {
    return ReadPedestrians(DataFolder() + file, x_column, y_column);
  };
  const std::vector<Column> columns = {
      {"eth by tens", {Resample(read("eth/obsmat.txt", 2, 4), 10)}},
      {"zara01", {read("zara01/obsmat.txt", 2, 4)}},
      {"zara03", {read("zara03/crowds_zara03.txt", 2, 3)}},
      {"students003", {read("students003/students003.txt", 2, 3)}}};
  for (const Column& column : columns) {
    if (column.files[0].empty()) GTEST_SKIP() << "recorded pedestrians are missing; set DSG_DATA";
  }
  const WindowScore left_out = LeaveOneOut(columns);
  const WindowScore last = MeanOf(columns, LastStep());
  const WindowScore weighted = MeanOf(columns, Weighted());
  std::cout << "  last step   " << last.ade_m << " / " << last.fde_m << "\n  weighted    "
            << weighted.ade_m << " / " << weighted.fde_m << "\n";
  EXPECT_LT(left_out.ade_m, weighted.ade_m);
  EXPECT_LT(left_out.fde_m, weighted.fde_m);
  EXPECT_LT(left_out.ade_m, last.ade_m);
}

struct PublishedScene {
  const char* folder;
  double ade_m;
  double fde_m;
};

// Constant velocity of the last step, every window of 20 consecutive frames of a person.
constexpr PublishedScene kPublished[] = {{"eth", 1.075, 2.282},
                                         {"hotel", 0.319, 0.614},
                                         {"univ", 0.524, 1.165},
                                         {"zara1", 0.427, 0.952},
                                         {"zara2", 0.324, 0.724}};

TEST(PublishedRow, IsReproducedFromTheCommunitysFiles) {
  const char* root = std::getenv("DSG_ETH_UCY");
  if (root == nullptr) {
    GTEST_SKIP() << "set DSG_ETH_UCY to a folder with the community's text files as "
                    "{eth,hotel,univ,zara1,zara2}/*.txt";
  }
  std::vector<Column> columns;
  for (const PublishedScene& scene : kPublished) {
    const std::filesystem::path folder = std::filesystem::path(root) / scene.folder;
    ASSERT_TRUE(std::filesystem::is_directory(folder)) << folder;
    Column column{scene.folder, {}};
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() != ".txt") continue;
      column.files.push_back(ReadPedestrians(entry.path().string(), 2, 3));
    }
    ASSERT_FALSE(column.files.empty()) << folder;
    const WindowScore last = ScoredColumn(column, LastStep());
    PrintScores(scene.folder, last, ScoredColumn(column, Weighted()),
                ScoredColumn(column, Adaptive({})));
    EXPECT_NEAR(last.ade_m, scene.ade_m, 1e-3) << scene.folder;
    EXPECT_NEAR(last.fde_m, scene.fde_m, 1e-3) << scene.folder;
    columns.push_back(std::move(column));
  }
  const WindowScore mean = MeanOf(columns, LastStep());
  EXPECT_NEAR(mean.ade_m, 0.534, 1e-3);
  EXPECT_NEAR(mean.fde_m, 1.148, 1e-3);
  const WindowScore left_out = LeaveOneOut(columns);
  EXPECT_LE(left_out.ade_m, 0.514);
  EXPECT_LE(left_out.fde_m, 1.09);
}

}  // namespace
}  // namespace dsg::query
