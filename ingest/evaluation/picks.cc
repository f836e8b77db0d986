// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/picks.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dsg::evaluation {
namespace {

// In doubles: stamps may be the ends of time.
double SecondsApart(TimeNs a, TimeNs b) {
  return std::abs(static_cast<double>(a) - static_cast<double>(b)) * 1e-9;
}

// The unused pick that a prediction is right about; -1 = none.
int FindPick(const PredictedPick& predicted, const std::vector<TruePick>& truth,
             const std::vector<bool>& is_used, double window_s) {
  int best = -1;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double apart = SecondsApart(predicted.pick_ns, truth[i].pick_ns);
    if (is_used[i] || truth[i].object != predicted.object || truth[i].human != predicted.human ||
        apart > window_s) {
      continue;
    }
    const bool is_nearer =
        best < 0 ||
        apart < SecondsApart(predicted.pick_ns, truth[static_cast<size_t>(best)].pick_ns);
    if (is_nearer) best = static_cast<int>(i);
  }
  return best;
}

}  // namespace

PickResult EvaluatePicks(const std::vector<PredictedPick>& predicted,
                         const std::vector<TruePick>& truth, const PickOptions& options) {
  PickResult result;
  result.prediction_count = static_cast<int64_t>(predicted.size());
  result.truth_count =
      std::count_if(truth.begin(), truth.end(), [](const TruePick& pick) { return pick.observed; });
  for (const TruePick& pick : truth) {
    if (!pick.observed) continue;
    result.mapped_count += pick.is_mapped ? 1 : 0;
    result.noticed_count += pick.is_noticed ? 1 : 0;
  }
  if (predicted.empty()) return result;
  std::vector<size_t> order(predicted.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&predicted](size_t a, size_t b) {
    return predicted[a].probability > predicted[b].probability;
  });
  std::vector<bool> is_used(truth.size(), false);
  int64_t found = 0;
  double squares = 0.0;
  for (const size_t i : order) {
    const PredictedPick& prediction = predicted[i];
    const int pick =
        FindPick(prediction, truth, is_used, static_cast<double>(options.window_ns) * 1e-9);
    const double miss = prediction.probability - (pick >= 0 ? 1.0 : 0.0);
    squares += miss * miss;
    if (pick >= 0) is_used[static_cast<size_t>(pick)] = true;
    if (prediction.probability < options.probability_min) continue;
    ++result.sure_count;
    if (pick < 0) continue;
    ++result.right_count;
    if (truth[static_cast<size_t>(pick)].observed) ++found;
  }
  result.brier = squares / static_cast<double>(predicted.size());
  if (result.sure_count > 0) {
    result.precision =
        static_cast<double>(result.right_count) / static_cast<double>(result.sure_count);
  }
  if (result.truth_count > 0) {
    result.recall = static_cast<double>(found) / static_cast<double>(result.truth_count);
  }
  return result;
}

}  // namespace dsg::evaluation
