// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "ingest/simulator/scene/image_effects.h"
#include "ingest/simulator/scene/renderer.h"
#include "tests/unit/ingest/simulator/scene/views.h"

namespace dsg::simulator {
namespace {

constexpr double kBaselineM = 0.1;
constexpr int kHalfPatch = 5;

struct StereoPair {
  RenderedView left;
  RenderedView right;
};

StereoPair RenderPair(const Renderer& renderer, const Pose3d& left) {
  const Pose3d right = left * Pose3d{{kBaselineM, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const ViewWants wants = {true, false, true, true, true, false};
  const auto camera = ReferenceCamera();
  return {*renderer.Render(left, camera, {}, wants), *renderer.Render(right, camera, {}, wants)};
}

float At(const std::vector<float>& values, int column, int row) {
  return values[static_cast<size_t>(row) * 720 + static_cast<size_t>(column)];
}

// A patch whose surface is one piece in both images and seen at no steep angle.
bool IsSmooth(const RenderedView& view, int column, int row) {
  const float depth = At(view.depth_m, column, row);
  for (int y = row - kHalfPatch; y <= row + kHalfPatch; y += kHalfPatch) {
    for (int x = column - kHalfPatch; x <= column + kHalfPatch; x += kHalfPatch) {
      if (std::abs(At(view.depth_m, x, y) - depth) > 0.02f * depth) return false;
    }
  }
  return At(view.incidence_cos, column, row) > 0.5f;
}

double MatchCost(const StereoPair& pair, int column, int row, int disparity) {
  double cost = 0.0;
  for (int y = -kHalfPatch; y <= kHalfPatch; ++y) {
    for (int x = -kHalfPatch; x <= kHalfPatch; ++x) {
      const double difference = At(pair.left.gray, column + x, row + y) -
                                At(pair.right.gray, column + x - disparity, row + y);
      cost += difference * difference;
    }
  }
  return cost;
}

// Best whole disparity by squared differences near a guess, then the minimum of the parabola
// through it and its neighbours. Negative when the best is at the border of the search.
double MatchDisparity(const StereoPair& pair, int column, int row, int guess) {
  constexpr int kReach = 4;
  std::array<double, 2 * kReach + 1> costs;
  for (int i = 0; i < static_cast<int>(costs.size()); ++i) {
    costs[i] = MatchCost(pair, column, row, guess - kReach + i);
  }
  const auto best = std::min_element(costs.begin(), costs.end()) - costs.begin();
  if (best == 0 || best + 1 == static_cast<ptrdiff_t>(costs.size())) return -1.0;
  const double bend = costs[best - 1] + costs[best + 1] - 2.0 * costs[best];
  if (bend <= 0.0) return -1.0;
  return guess - kReach + static_cast<double>(best) +
         0.5 * (costs[best - 1] - costs[best + 1]) / bend;
}

class Stereo : public testing::TestWithParam<WorldKind> {
 protected:
  void SetUp() override {
    const auto world = GenerateWorld({GetParam(), 1});
    ASSERT_TRUE(world.ok());
    auto renderer = Renderer::Create(BuildScene(*world, {}));
    ASSERT_TRUE(renderer.ok());
    renderer_ = *std::move(renderer);
    views_ = TourViews(*world, 6);
  }

  std::unique_ptr<Renderer> renderer_;
  std::vector<Pose3d> views_;
};

INSTANTIATE_TEST_SUITE_P(Worlds, Stereo,
                         testing::Values(WorldKind::kApartment, WorldKind::kOffice));

// A point of the left image, taken by its depth to the right one, has there the depth that its
// disparity f b / z says.
TEST_P(Stereo, DepthsOfBothImagesAgreeWithTheDisparity) {
  const auto camera = ReferenceCamera();
  int checked = 0;
  int wrong = 0;
  for (const Pose3d& pose : views_) {
    const StereoPair pair = RenderPair(*renderer_, pose);
    for (int row = 20; row < 460; row += 9) {
      for (int column = 120; column < 700; column += 9) {
        if (!IsSmooth(pair.left, column, row)) continue;
        const double z = At(pair.left.depth_m, column, row);
        const double disparity = camera.fx * kBaselineM / z;
        const double x = column - disparity;
        const int low = static_cast<int>(std::floor(x));
        if (low < kHalfPatch || !IsSmooth(pair.right, low, row)) continue;
        // Inverse depth is linear along a row of a plane.
        const double share = x - low;
        const double inverse = (1.0 - share) / At(pair.right.depth_m, low, row) +
                               share / At(pair.right.depth_m, low + 1, row);
        const double error_px = camera.fx * kBaselineM * std::abs(inverse - 1.0 / z);
        // Where something else hides the point from the right camera they differ much.
        if (error_px > 1.0) continue;
        ++checked;
        wrong += error_px > 0.05 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(checked, 3000);
  EXPECT_LT(wrong, 0.01 * checked);
}

TEST_P(Stereo, MatchedPatchesAgreeWithTheDisparity) {
  const auto camera = ReferenceCamera();
  std::vector<double> errors;
  for (const Pose3d& pose : views_) {
    StereoPair pair = RenderPair(*renderer_, pose);
    CameraEffects effects;
    effects.read_noise = effects.shot_noise = 0.0;
    Random random(1, 1);
    ingest::Image image = MakeGray(pair.left, effects, &random);
    const cv::Mat gray(image.height, image.width, CV_8U, image.bytes.data());
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(gray, corners, 300, 0.001, 8.0, cv::noArray(), 3);
    for (const cv::Point2f& corner : corners) {
      const int column = static_cast<int>(corner.x);
      const int row = static_cast<int>(corner.y);
      if (row < 12 || row > 467 || column > 707 || column < 140) continue;
      if (!IsSmooth(pair.left, column, row)) continue;
      const double truth = camera.fx * kBaselineM / At(pair.left.depth_m, column, row);
      if (column - truth < 20.0) continue;
      const int other = static_cast<int>(std::lround(column - truth));
      if (!IsSmooth(pair.right, other, row)) continue;
      // Hidden from the right camera.
      const double there = camera.fx * kBaselineM / At(pair.right.depth_m, other, row);
      if (std::abs(there - truth) > 0.5) continue;
      const double found = MatchDisparity(pair, column, row, static_cast<int>(std::lround(truth)));
      if (found >= 0.0) errors.push_back(std::abs(found - truth));
    }
  }
  ASSERT_GT(errors.size(), 150u);
  std::sort(errors.begin(), errors.end());
  const double median = errors[errors.size() / 2];
  const double high = errors[errors.size() * 95 / 100];
  RecordProperty("median_px", std::to_string(median));
  RecordProperty("p95_px", std::to_string(high));
  std::printf("%zu matches: median %.3f px, 95 %% %.3f px\n", errors.size(), median, high);
  EXPECT_LT(median, 0.1);
  EXPECT_LT(high, 0.3);
}

}  // namespace
}  // namespace dsg::simulator
