// SPDX-License-Identifier: Apache-2.0
// One number from measurements of it, most of which may be wrong.
// Refuses several answers: the cheapest consensus set wins.
#pragma once

#include <vector>

namespace dsg {

struct Measurement {
  double value = 0.0;
  /// A true measurement misses by no more than this. Requires: above zero.
  double bound = 1.0;
};

struct Vote {
  double value = 0.0;
  /// Sum over measurements of min((miss / bound)^2, 1).
  double cost = 0.0;
};

/// Minimises the truncated least squares exactly: the consensus set changes only where the interval
/// of a measurement begins or ends, so every set there can be is tried. {0, 0} without any.
///
/// Requires: finite values and bounds.
/// Cost: n log n.
/// Source: Yang, Shi and Carlone, 2021, adaptive voting.
Vote VoteAdaptively(const std::vector<Measurement>& measurements);

}  // namespace dsg
