// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/image_effects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace dsg::simulator {
namespace {

using ingest::DepthAt;
using ingest::LabelAt;

constexpr int kWidth = 320;
constexpr int kHeight = 240;

RenderedView FlatView(float light, float depth_m, uint16_t label) {
  RenderedView view;
  view.width = kWidth;
  view.height = kHeight;
  const size_t count = static_cast<size_t>(kWidth) * kHeight;
  view.gray.assign(count, light);
  view.rgb.assign(3 * count, light);
  view.depth_m.assign(count, depth_m);
  view.incidence_cos.assign(count, 1.0f);
  view.label.assign(count, label);
  return view;
}

struct Moments {
  double mean = 0.0;
  double sigma = 0.0;
};

Moments MomentsOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  const double mean = sum / static_cast<double>(values.size());
  double square = 0.0;
  for (const double value : values) square += (value - mean) * (value - mean);
  return {mean, std::sqrt(square / static_cast<double>(values.size()))};
}

TEST(CameraEffects, NoiseHasItsStandardDeviation) {
  CameraEffects effects;
  effects.vignetting = 0.0;
  for (const float light : {0.2f, 0.5f}) {
    Random random(7, 1);
    const ingest::Image image = MakeGray(FlatView(light, 1.0f, 0), effects, &random);
    const Moments moments = MomentsOf(std::vector<double>(image.bytes.begin(), image.bytes.end()));
    EXPECT_NEAR(moments.mean, 255.0 * light, 0.1);
    // Rounding adds a twelfth.
    EXPECT_NEAR(moments.sigma, std::sqrt(1.0 + 9.0 * light + 1.0 / 12.0), 0.05);
  }
}

TEST(CameraEffects, GainBrightensAndCornersLoseLight) {
  CameraEffects effects;
  effects.read_noise = effects.shot_noise = 0.0;
  effects.gain = 1.1;
  effects.vignetting = 0.25;
  Random random(7, 1);
  const ingest::Image image = MakeGray(FlatView(0.5f, 1.0f, 0), effects, &random);
  EXPECT_NEAR(image.bytes[image.Offset(kWidth / 2, kHeight / 2)], 0.5 * 255 * 1.1, 1.0);
  EXPECT_NEAR(image.bytes[image.Offset(0, 0)], 0.75 * 0.5 * 255 * 1.1, 1.0);
  const ingest::Image rgb = MakeRgb(FlatView(0.5f, 1.0f, 0), effects, &random);
  EXPECT_EQ(rgb.bytes.size(), 3 * image.bytes.size());
  EXPECT_EQ(rgb.bytes[rgb.Offset(5, 5) + 2], image.bytes[image.Offset(5, 5)]);
}

TEST(CameraEffects, DependOnTheRandomNumbersAlone) {
  const RenderedView view = FlatView(0.4f, 2.0f, LabelValue(11, 1));
  Random a(3, 9);
  Random b(3, 9);
  Random c(3, 10);
  const ingest::Image first = MakeGray(view, {}, &a);
  EXPECT_EQ(first.bytes, MakeGray(view, {}, &b).bytes);
  EXPECT_NE(first.bytes, MakeGray(view, {}, &c).bytes);
}

TEST(ExposureGain, DriftsSmoothlyWithinTenPercent) {
  double low = 2.0;
  double high = 0.0;
  for (int i = 0; i < 6000; ++i) {
    const double gain = ExposureGain(int64_t{50'000'000} * i, 4);
    low = std::min(low, gain);
    high = std::max(high, gain);
    EXPECT_NEAR(gain, ExposureGain(int64_t{50'000'000} * (i + 1), 4), 0.003);
  }
  EXPECT_GE(low, 0.9);
  EXPECT_LE(high, 1.1);
  EXPECT_GT(high - low, 0.08);
  EXPECT_NE(ExposureGain(0, 4), ExposureGain(0, 5));
}

TEST(DepthEffects, NoiseGrowsWithTheSquareOfTheDepth) {
  for (const float depth : {1.0f, 4.0f, 8.0f}) {
    Random random(5, 2);
    const ingest::Image image = MakeDepth(FlatView(0.5f, depth, 0), {}, &random);
    std::vector<double> values;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        values.push_back(DepthAt(image, column, row));
      }
    }
    const Moments moments = MomentsOf(values);
    const double sigma = 0.0025 + 0.002 * depth * depth;
    EXPECT_NEAR(moments.mean, depth, 0.02 * sigma + 2e-4);
    EXPECT_NEAR(moments.sigma, sigma, 0.03 * sigma);
  }
}

TEST(DepthEffects, LoseWhatIsFarGrazingOrAtEdges) {
  RenderedView view = FlatView(0.5f, 2.0f, 0);
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const size_t at = static_cast<size_t>(row) * kWidth + static_cast<size_t>(column);
      if (column >= 100) view.depth_m[at] = 3.0f;
      if (column >= 200) view.depth_m[at] = 11.0f;
      if (row >= 200) view.incidence_cos[at] = 0.2f;
    }
  }
  Random random(5, 2);
  const ingest::Image image = MakeDepth(view, {}, &random);
  EXPECT_GT(DepthAt(image, 50, 100), 1.9f);
  EXPECT_EQ(DepthAt(image, 99, 100), 0.0f);
  EXPECT_EQ(DepthAt(image, 100, 100), 0.0f);
  EXPECT_GT(DepthAt(image, 102, 100), 2.8f);
  EXPECT_EQ(DepthAt(image, 250, 100), 0.0f);
  EXPECT_EQ(DepthAt(image, 50, 210), 0.0f);
  const ingest::Image clean = MakeCleanDepth(view);
  EXPECT_FLOAT_EQ(DepthAt(clean, 99, 100), 2.0f);
  EXPECT_FLOAT_EQ(DepthAt(clean, 250, 210), 11.0f);
}

TEST(DepthEffects, KeepSlopesWhole) {
  RenderedView view = FlatView(0.5f, 2.0f, 0);
  // A floor: inverse depth is linear over the rows, steps of 3 % and more near the top.
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      view.depth_m[static_cast<size_t>(row) * kWidth + static_cast<size_t>(column)] =
          200.0f / static_cast<float>(row + 25);
    }
  }
  DepthEffects effects;
  effects.range_m_max = 100.0;
  Random random(5, 2);
  const ingest::Image image = MakeDepth(view, effects, &random);
  for (int row = 2; row < kHeight; ++row) EXPECT_GT(DepthAt(image, 9, row), 0.0f) << row;
}

TEST(LabelEffects, MissAndSwapInstancesAsOftenAsAsked) {
  const std::vector<int> classes = {10, 11, 12};
  LabelEffects effects;
  effects.jitter_px_min = effects.jitter_px_max = 0.0;
  RenderedView view = FlatView(0.5f, 2.0f, LabelValue(1, 0));
  for (int i = 0; i < 200; ++i) {
    for (int k = 0; k < 9; ++k) view.label[i * 9 + k] = LabelValue(11, i + 1);
  }
  int missed = 0;
  int swapped = 0;
  constexpr int kImages = 60;
  for (int frame = 0; frame < kImages; ++frame) {
    Random random(8, frame);
    const ingest::Image image = MakeLabels(view, effects, classes, &random);
    for (int i = 0; i < 200; ++i) {
      const int at = i * 9 + 4;
      const uint16_t label = LabelAt(image, at % kWidth, at / kWidth);
      missed += label == 0 ? 1 : 0;
      if (label != 0 && label != LabelValue(11, i + 1)) {
        ++swapped;
        EXPECT_TRUE(label >> 8 == 10 || label >> 8 == 12);
        EXPECT_EQ(label & 255, i + 1);
      }
    }
    EXPECT_EQ(LabelAt(image, 100, 200), LabelValue(1, 0));
  }
  const double total = 200.0 * kImages;
  EXPECT_NEAR(missed / total, 0.02, 0.006);
  EXPECT_NEAR(swapped / total, 0.01, 0.004);
}

TEST(LabelEffects, MoveOutlinesByAFewPixelsOnly) {
  RenderedView view = FlatView(0.5f, 2.0f, LabelValue(1, 0));
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 160; column < kWidth; ++column) {
      view.label[static_cast<size_t>(row) * kWidth + static_cast<size_t>(column)] =
          LabelValue(2, 0);
    }
  }
  Random random(8, 1);
  const ingest::Image image = MakeLabels(view, {}, std::vector<int>{10}, &random);
  int moved = 0;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const uint16_t label = LabelAt(image, column, row);
      const bool is_same = label == LabelValue(column >= 160 ? 2 : 1, 0);
      if (std::abs(column - 160) > 4) {
        EXPECT_TRUE(is_same);
      }
      moved += is_same ? 0 : 1;
    }
  }
  EXPECT_GT(moved, kHeight / 6);
  EXPECT_LT(moved, kHeight * 3);
  EXPECT_EQ(LabelAt(MakeCleanLabels(view), 160, 7), LabelValue(2, 0));
}

}  // namespace
}  // namespace dsg::simulator
