// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/spline.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dsg::simulator {
namespace {

constexpr int kDegree = 5;

using Weights = std::array<double, kDegree + 1>;

// From the weights of degree k - 1 to those of degree k, `u` in [0, 1] within the segment.
Weights RaiseDegree(const Weights& lower, int k, double u) {
  Weights raised{};
  for (int j = 0; j <= k; ++j) {
    const double left = j > 0 ? (u + k - j) * lower[j - 1] : 0.0;
    const double right = j < k ? (j + 1 - u) * lower[j] : 0.0;
    raised[j] = (left + right) / k;
  }
  return raised;
}

}  // namespace

QuinticSpline::QuinticSpline(double duration_s, double knot_s,
                             const std::function<Value(double)>& reference)
    : knot_s_(knot_s) {
  const int segment_count = std::max(1, static_cast<int>(std::ceil(duration_s / knot_s)));
  control_.reserve(static_cast<size_t>(segment_count + kDegree));
  for (int i = 0; i < segment_count + kDegree; ++i) control_.push_back(reference((i - 2) * knot_s));
}

QuinticSpline::Sample QuinticSpline::At(double time_s) const {
  const int segment_count = static_cast<int>(control_.size()) - kDegree;
  const double knots = time_s / knot_s_;
  const int segment = std::clamp(static_cast<int>(std::floor(knots)), 0, segment_count - 1);
  const double u = knots - segment;
  Weights cubic{1.0};
  for (int k = 1; k <= 3; ++k) cubic = RaiseDegree(cubic, k, u);
  const Weights quartic = RaiseDegree(cubic, 4, u);
  const Weights quintic = RaiseDegree(quartic, 5, u);

  // All in differences, so that equal control points give zeros and not rounding errors.
  const Value* c = &control_[segment];
  Sample sample;
  for (int j = 0; j <= 5; ++j) sample.value += quintic[j] * (c[j] - c[0]);
  for (int j = 0; j <= 4; ++j) sample.rate += quartic[j] * (c[j + 1] - c[j]);
  for (int j = 0; j <= 3; ++j) {
    sample.rate_of_rate += cubic[j] * ((c[j + 2] - c[j + 1]) - (c[j + 1] - c[j]));
  }
  sample.value += c[0];
  sample.rate /= knot_s_;
  sample.rate_of_rate /= knot_s_ * knot_s_;
  return sample;
}

}  // namespace dsg::simulator
