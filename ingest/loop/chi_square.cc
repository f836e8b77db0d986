// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/chi_square.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::ingest {
namespace {

double ChanceAbove(double value, bool is_planar) {
  if (is_planar) {
    return std::erfc(std::sqrt(0.5 * value)) +
           std::sqrt(2.0 * value / std::numbers::pi) * std::exp(-0.5 * value);
  }
  return std::exp(-0.5 * value) * (1.0 + 0.5 * value + value * value / 8.0);
}

}  // namespace

double ChiSquareGate(double confidence, bool is_planar) {
  const double above = 1.0 - std::clamp(confidence, 0.0, 1.0 - 1e-12);
  // Halved to the last digit: no option.
  double low = 0.0;
  double high = 100.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (ChanceAbove(middle, is_planar) > above ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace dsg::ingest
