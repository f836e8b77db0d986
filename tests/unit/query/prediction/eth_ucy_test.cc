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

void Print(const std::string& name, const WindowScore& last, const WindowScore& weighted) {
  std::cout << std::fixed << std::setprecision(3) << std::left << std::setw(14) << name
            << " last step " << last.ade_m << " / " << last.fde_m << "  weighted " << weighted.ade_m
            << " / " << weighted.fde_m << " (options tuned on such scenes)  " << last.window_count
            << " windows\n";
}

WindowScore Scored(const Pedestrians& pedestrians, int64_t frame_step, Predictor predictor) {
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
  const WindowScore last = Scored(pedestrians, scene.frame_step, Predictor::kLastStep);
  Print(scene.file, last, Scored(pedestrians, scene.frame_step, Predictor::kWeighted));
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
  const WindowScore last = Scored(pedestrians, 10, Predictor::kLastStep);
  Print("eth by tens", last, Scored(pedestrians, 10, Predictor::kWeighted));
  EXPECT_EQ(last.window_count, 364);
  EXPECT_NEAR(last.ade_m, 1.075, 1e-3);
  EXPECT_NEAR(last.fde_m, 2.282, 1e-3);
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
  WindowScore mean;
  for (const PublishedScene& scene : kPublished) {
    WindowScore last;
    WindowScore weighted;
    const std::filesystem::path folder = std::filesystem::path(root) / scene.folder;
    ASSERT_TRUE(std::filesystem::is_directory(folder)) << folder;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() != ".txt") continue;
      const Pedestrians pedestrians = ReadPedestrians(entry.path().string(), 2, 3);
      ScoreWindows(pedestrians, 10, Predictor::kLastStep, &last);
      ScoreWindows(pedestrians, 10, Predictor::kWeighted, &weighted);
    }
    ASSERT_GT(last.window_count, 0) << folder;
    Print(scene.folder, Means(last), Means(weighted));
    EXPECT_NEAR(Means(last).ade_m, scene.ade_m, 1e-3) << scene.folder;
    EXPECT_NEAR(Means(last).fde_m, scene.fde_m, 1e-3) << scene.folder;
    mean.ade_m += Means(last).ade_m / std::size(kPublished);
    mean.fde_m += Means(last).fde_m / std::size(kPublished);
  }
  EXPECT_NEAR(mean.ade_m, 0.534, 1e-3);
  EXPECT_NEAR(mean.fde_m, 1.148, 1e-3);
}

}  // namespace
}  // namespace dsg::query
