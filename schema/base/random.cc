// SPDX-License-Identifier: Apache-2.0
#include "schema/base/random.h"

#include <cmath>
#include <numbers>

namespace dsg {
namespace {

// Source: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014. The
// finalizer maps neighbouring seeds to unrelated ones.
uint64_t Mix(uint64_t value) {
  value += 0x9e3779b97f4a7c15ull;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ull;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebull;
  return value ^ (value >> 31);
}

}  // namespace

Random::Random(uint64_t seed, uint64_t stream) : engine_(Mix(Mix(seed) ^ stream)) {}

double Random::Uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

double Random::Uniform(double low, double high) { return low + (high - low) * Uniform(); }

int Random::Index(int count) { return static_cast<int>(Uniform() * count); }

int Random::Integer(int low, int high) { return low + Index(high - low + 1); }

double Random::Normal() {
  if (spare_normal_.has_value()) {
    const double value = *spare_normal_;
    spare_normal_.reset();
    return value;
  }
  // Box and Muller, 1958. 1 - Uniform() is in (0, 1], so the logarithm is finite.
  const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
  const double angle = 2.0 * std::numbers::pi * Uniform();
  spare_normal_ = radius * std::sin(angle);
  return radius * std::cos(angle);
}

double Random::Exponential() { return -std::log(1.0 - Uniform()); }

}  // namespace dsg
