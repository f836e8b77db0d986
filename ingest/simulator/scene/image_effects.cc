// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/image_effects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

namespace dsg::simulator {
namespace {

using ingest::Image;
using ingest::PixelFormat;

/// Normal numbers, drawn once; a row of an image starts anywhere in them.
class NormalTable {
 public:
  static const NormalTable& Get() {
    static const NormalTable table;
    return table;
  }
  /// `count` numbers in a row. Requires: count <= kRunMax.
  const float* Draw(Random* random) const {
    return values_.data() + random->Index(static_cast<int>(kSize - kRunMax));
  }

  static constexpr size_t kRunMax = 1u << 16;

 private:
  static constexpr size_t kSize = 1u << 19;

  NormalTable() : values_(kSize) {
    Random random(20, 1);
    for (float& value : values_) value = static_cast<float>(random.Normal());
  }

  std::vector<float> values_;
};

Image MakeImage(const RenderedView& view, PixelFormat format) {
  Image image;
  image.width = view.width;
  image.height = view.height;
  image.format = format;
  image.bytes.resize(static_cast<size_t>(view.width) * static_cast<size_t>(view.height) *
                     static_cast<size_t>(ingest::BytesPerPixel(format)));
  return image;
}

void Write16(size_t pixel, uint16_t value, Image* image) {
  image->bytes[2 * pixel] = static_cast<uint8_t>(value & 255u);
  image->bytes[2 * pixel + 1] = static_cast<uint8_t>(value >> 8);
}

// Light that the lens loses, by pixel.
class Vignette {
 public:
  Vignette(const RenderedView& view, double loss)
      : column_(0.5f * static_cast<float>(view.width - 1)),
        row_(0.5f * static_cast<float>(view.height - 1)),
        scale_(static_cast<float>(loss) / std::max(column_ * column_ + row_ * row_, 1.0f)) {}

  float At(int column, int row) const {
    const float x = static_cast<float>(column) - column_;
    const float y = static_cast<float>(row) - row_;
    return 1.0f - scale_ * (x * x + y * y);
  }

 private:
  const float column_;
  const float row_;
  const float scale_;
};

uint8_t Expose(float light, const CameraEffects& effects, float normal) {
  const float clean = 255.0f * std::clamp(light, 0.0f, 1.0f);
  const float read = static_cast<float>(effects.read_noise);
  const float shot = static_cast<float>(effects.shot_noise);
  const float sigma = std::sqrt(read * read + shot * shot * clean * (1.0f / 255.0f));
  return static_cast<uint8_t>(std::clamp(clean + sigma * normal + 0.5f, 0.0f, 255.0f));
}

Image MakeCameraImage(const RenderedView& view, const std::vector<float>& light, int channel_count,
                      const CameraEffects& effects, Random* random) {
  Image image = MakeImage(view, channel_count == 1 ? PixelFormat::kGray8 : PixelFormat::kRgb8);
  const Vignette vignette(view, effects.vignetting);
  const float gain = static_cast<float>(effects.gain);
  size_t at = 0;
  for (int row = 0; row < view.height; ++row) {
    const float* normal = NormalTable::Get().Draw(random);
    for (int column = 0; column < view.width; ++column) {
      const float scale = gain * vignette.At(column, row);
      for (int channel = 0; channel < channel_count; ++channel, ++at) {
        image.bytes[at] = Expose(light[at] * scale, effects, *normal++);
      }
    }
  }
  return image;
}

uint16_t Millimetres(double depth_m) {
  const double rounded = std::floor(1000.0 * depth_m + 0.5);
  return rounded >= 1.0 && rounded <= 65535.0 ? static_cast<uint16_t>(rounded) : uint16_t{0};
}

bool IsDepthEdge(const RenderedView& view, int column, int row, double ratio) {
  const size_t width = static_cast<size_t>(view.width);
  const size_t at = static_cast<size_t>(row) * width + static_cast<size_t>(column);
  const float depth = view.depth_m[at];
  const float bound = static_cast<float>(ratio) * depth;
  // A slope seen flat is no edge: what counts is the bend between both sides.
  const auto bends = [&](size_t before, size_t after) {
    return std::abs(view.depth_m[before] + view.depth_m[after] - 2.0f * depth) > bound;
  };
  if (column > 0 && column + 1 < view.width && bends(at - 1, at + 1)) return true;
  return row > 0 && row + 1 < view.height && bends(at - width, at + width);
}

// Outlines wander with a field that is smooth over this many pixels.
constexpr int kJitterPitch = 12;

class JitterField {
 public:
  JitterField(int width, int height, double amplitude, Random* random)
      : columns_(width / kJitterPitch + 2), amplitude_(static_cast<float>(amplitude)) {
    const size_t count =
        static_cast<size_t>(columns_) * static_cast<size_t>(height / kJitterPitch + 2);
    values_.reserve(count);
    for (size_t i = 0; i < count; ++i) {
      values_.push_back(static_cast<float>(random->Uniform(-1.0, 1.0)));
    }
  }

  int At(int column, int row) const {
    const int x = column / kJitterPitch;
    const int y = row / kJitterPitch;
    const float dx = static_cast<float>(column % kJitterPitch) / kJitterPitch;
    const float dy = static_cast<float>(row % kJitterPitch) / kJitterPitch;
    const float* low = values_.data() + static_cast<size_t>(y) * static_cast<size_t>(columns_) + x;
    const float* high = low + columns_;
    const float a = low[0] + dx * (low[1] - low[0]);
    const float b = high[0] + dx * (high[1] - high[0]);
    return static_cast<int>(std::lround(amplitude_ * (a + dy * (b - a))));
  }

 private:
  const int columns_;
  const float amplitude_;
  std::vector<float> values_;
};

// What the network calls each label of the image.
std::vector<uint16_t> DrawNames(const std::vector<uint16_t>& labels, const LabelEffects& effects,
                                std::span<const int> classes, Random* random) {
  std::vector<uint16_t> names(1u << 16);
  for (size_t i = 0; i < names.size(); ++i) names[i] = static_cast<uint16_t>(i);
  std::vector<uint8_t> present(names.size());
  for (const uint16_t label : labels) present[label] = 1;
  for (size_t label = 0; label < names.size(); ++label) {
    if (present[label] == 0 || (label & 255u) == 0) continue;
    const double chance = random->Uniform();
    const double pick = random->Uniform();
    if (chance < effects.miss_probability) {
      names[label] = 0;
    } else if (chance < effects.miss_probability + effects.swap_probability) {
      std::vector<int> others;
      for (const int id : classes) {
        if (id != static_cast<int>(label >> 8)) others.push_back(id);
      }
      if (others.empty()) continue;
      const size_t index = static_cast<size_t>(pick * static_cast<double>(others.size()));
      names[label] = LabelValue(others[index], static_cast<int>(label & 255u));
    }
  }
  return names;
}

}  // namespace

double ExposureGain(TimeNs time_ns, uint64_t seed) {
  Random random(seed, 0x6761696e);
  const double time_s = static_cast<double>(time_ns) * 1e-9;
  // Three waves of periods that have no common multiple; weights sum up to the bound.
  constexpr std::array<double, 3> kPeriodsS = {7.3, 17.9, 41.7};
  constexpr std::array<double, 3> kWeights = {0.02, 0.035, 0.045};
  double gain = 1.0;
  for (size_t i = 0; i < kPeriodsS.size(); ++i) {
    const double phase = random.Uniform();
    gain += kWeights[i] * std::sin(2.0 * std::numbers::pi * (time_s / kPeriodsS[i] + phase));
  }
  return gain;
}

Image MakeGray(const RenderedView& view, const CameraEffects& effects, Random* random) {
  return MakeCameraImage(view, view.gray, 1, effects, random);
}

Image MakeRgb(const RenderedView& view, const CameraEffects& effects, Random* random) {
  return MakeCameraImage(view, view.rgb, 3, effects, random);
}

Image MakeCleanDepth(const RenderedView& view) {
  Image image = MakeImage(view, PixelFormat::kDepth16);
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    Write16(i, Millimetres(view.depth_m[i]), &image);
  }
  return image;
}

Image MakeDepth(const RenderedView& view, const DepthEffects& effects, Random* random) {
  Image image = MakeImage(view, PixelFormat::kDepth16);
  const double cosine_min = std::cos(effects.grazing_deg_max * std::numbers::pi / 180.0);
  size_t at = 0;
  for (int row = 0; row < view.height; ++row) {
    const float* normal = NormalTable::Get().Draw(random);
    for (int column = 0; column < view.width; ++column, ++at) {
      const double depth = view.depth_m[at];
      const double error =
          *normal++ * (effects.sigma_base_m + effects.sigma_square_per_m * depth * depth);
      const bool is_read = depth > 0.0 && view.incidence_cos[at] >= cosine_min &&
                           depth + error <= effects.range_m_max &&
                           !IsDepthEdge(view, column, row, effects.edge_ratio);
      Write16(at, is_read ? Millimetres(depth + error) : uint16_t{0}, &image);
    }
  }
  return image;
}

Image MakeCleanLabels(const RenderedView& view) {
  Image image = MakeImage(view, PixelFormat::kLabel16);
  for (size_t i = 0; i < view.label.size(); ++i) Write16(i, view.label[i], &image);
  return image;
}

Image MakeLabels(const RenderedView& view, const LabelEffects& effects,
                 std::span<const int> classes, Random* random) {
  Image image = MakeImage(view, PixelFormat::kLabel16);
  const double amplitude = random->Uniform(effects.jitter_px_min, effects.jitter_px_max);
  const JitterField along_x(view.width, view.height, amplitude, random);
  const JitterField along_y(view.width, view.height, amplitude, random);
  const std::vector<uint16_t> names = DrawNames(view.label, effects, classes, random);
  size_t at = 0;
  for (int row = 0; row < view.height; ++row) {
    for (int column = 0; column < view.width; ++column, ++at) {
      const int x = std::clamp(column + along_x.At(column, row), 0, view.width - 1);
      const int y = std::clamp(row + along_y.At(column, row), 0, view.height - 1);
      const size_t from =
          static_cast<size_t>(y) * static_cast<size_t>(view.width) + static_cast<size_t>(x);
      Write16(at, names[view.label[from]], &image);
    }
  }
  return image;
}

}  // namespace dsg::simulator
