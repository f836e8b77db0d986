// SPDX-License-Identifier: Apache-2.0
// Whether it was rightly told who took which object, and how sure to be of it.
// Refuses to reward a guess that was kept below the threshold.
#pragma once

#include <optional>
#include <vector>

#include "schema/base/time.h"

namespace dsg::evaluation {

struct TruePick {
  int object = 0;
  int human = 0;
  TimeNs pick_ns = 0;
  bool observed = true;
  /// Whether the map had the object where it was taken from, and ended it there after the pick.
  bool is_mapped = false;
  bool is_noticed = false;
};

struct PredictedPick {
  /// True object and human that the predicted ones were matched to; -1 = none.
  int object = -1;
  int human = -1;
  TimeNs pick_ns = 0;
  double probability = 0.0;
};

struct PickOptions {
  TimeNs window_ns = 5 * kNsPerSecond;
  /// Less sure predictions are abstentions: they count in the Brier score alone.
  double probability_min = 0.6;
};

/// Shares from 0 to 1. All empty when nothing was predicted.
struct PickResult {
  /// Right predictions among those at or above probability_min; empty when there are none.
  std::optional<double> precision;
  /// Of the picks that the cameras could tell, the share rightly predicted.
  std::optional<double> recall;
  /// Mean of (probability - outcome)^2 over all predictions.
  std::optional<double> brier;
  int64_t truth_count = 0;
  int64_t prediction_count = 0;
  /// Predictions at or above probability_min, and the right ones of them.
  int64_t sure_count = 0;
  int64_t right_count = 0;
  /// Of the picks that the cameras could tell: those whose object the map had where it was taken
  /// from, and those of which it noticed that the object went.
  int64_t mapped_count = 0;
  int64_t noticed_count = 0;
};

/// A prediction is right if a pick of that object by that human is within the window; each pick
/// serves one prediction, the surest first. Source: Brier 1950.
PickResult EvaluatePicks(const std::vector<PredictedPick>& predicted,
                         const std::vector<TruePick>& truth, const PickOptions& options);

}  // namespace dsg::evaluation
