// SPDX-License-Identifier: Apache-2.0
// Random numbers that are the same on every machine and with every standard library.
// Refuses to use the distributions of <random>, whose results the standard leaves open.
#pragma once

#include <cstdint>
#include <optional>
#include <random>

namespace dsg {

/// One stream of random numbers. Streams of one seed are independent of each other, so that a
/// tenth walker does not change the paths of the first nine.
///
/// Threads: one caller at a time.
class Random {
 public:
  Random(uint64_t seed, uint64_t stream);

  /// In [0, 1), 53 bits.
  double Uniform();
  /// In [low, high).
  double Uniform(double low, double high);
  /// In [0, count). Requires: count > 0.
  int Index(int count);
  /// In [low, high], both included. Requires: low <= high.
  int Integer(int low, int high);
  bool Chance(double probability) { return Uniform() < probability; }
  /// Mean 0, standard deviation 1.
  double Normal();
  /// Mean 1.
  double Exponential();

 private:
  std::mt19937_64 engine_;
  std::optional<double> spare_normal_;
};

}  // namespace dsg
