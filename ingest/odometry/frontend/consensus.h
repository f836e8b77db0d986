// SPDX-License-Identifier: Apache-2.0
// Random samples for models that outliers must not spoil: which are drawn, and how many.
#pragma once

#include <span>
#include <vector>

#include "ingest/odometry/frontend/frontend_options.h"
#include "schema/base/random.h"

namespace dsg::ingest {

/// How many samples of `sample_size` hold one without outliers with chance `probability`, if a
/// share `agree_share` of all points is right: log(1 - probability) / log(1 - share^size), rounded
/// up. At least 1, at most 1e9. Requires: sample_size > 0, 0 < probability < 1.
/// Source: Fischler and Bolles, 1981 (RANSAC).
int SampleCountFor(double agree_share, int sample_size, double probability);

/// The samples of one search. Counts bound it, never clocks: the same points and options give the
/// same samples.
class SampleDraws {
 public:
  /// Requires: 0 < sample_size <= point_count.
  SampleDraws(int point_count, int sample_size, const ConsensusOptions& options);

  /// Different numbers in [0, point_count), valid until the next call; empty when enough samples
  /// were drawn.
  std::span<const int> Next();
  /// The best model so far agrees with so many points: fewer samples are needed.
  void NoteAgreement(int agree_count);

  int drawn_count() const { return drawn_count_; }

 private:
  ConsensusOptions options_;
  size_t sample_size_;
  Random random_;
  /// A permutation of all numbers, of which the first ones are the sample.
  std::vector<int> order_;
  int needed_count_;
  int drawn_count_ = 0;
};

/// Whether a model that agrees with `agree_count` of `point_count` points is believed.
bool IsConsensus(int agree_count, int point_count, const ConsensusOptions& options);

}  // namespace dsg::ingest
