// SPDX-License-Identifier: Apache-2.0
// Random numbers that are the same on every machine and with every standard library. The
// distributions of <random> are not used, because the standard does not define their results.
#pragma once

#include <cstdint>
#include <optional>
#include <random>

namespace dsg {

/// A stream of random numbers. Streams with the same seed are independent, so that for example a
/// tenth walker does not change the paths of the first nine.
///
/// Threads: one caller at a time.
class Random {
 public:
  Random(uint64_t seed, uint64_t stream);

  /// Uniform in [0, 1), 53 bits.
  double Uniform();
  /// Uniform in [low, high).
  double Uniform(double low, double high);
  /// Uniform in [0, count). Requires: count > 0.
  int Index(int count);
  /// Uniform in [low, high], both included. Requires: low <= high.
  int Integer(int low, int high);
  bool Chance(double probability) { return Uniform() < probability; }
  /// Normal with mean 0, standard deviation 1.
  double Normal();
  /// Exponential with mean 1.
  double Exponential();

 private:
  std::mt19937_64 engine_;
  std::optional<double> spare_normal_;
};

}  // namespace dsg
