// SPDX-License-Identifier: Apache-2.0
// Fits the weights of query/engine/interaction/weights.h to simulated picks whose doer is known:
// a conditional logit over the candidates of each change, drawn towards the present weights.
//   interactions_fit KIND:PEOPLE:FIRST:LAST ...
// Prints the weights for a person to judge. Refuses seeds that are kept for tests, 11 and up.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "query/engine/interaction/verdict.h"
#include "query/engine/interaction/weights.h"
#include "schema/base/status.h"
#include "tests/eval/pick_score.h"
#include "tests/eval/pick_worlds.h"

namespace dsg::eval {
namespace {

namespace weights = query::weights;

enum Weight {
  kHandAtBox,
  kHandSigma,
  kHandFloor,
  kHandUnseen,
  kMayVisit,
  kMayVisitTime,
  kDwell,
  kVisitWindow,
  kOutOfReach,
  kUnobserved,
  kDelay,
  kCarried,
  kUnseenRate,
  kUnwatchedRate,
  kFalseChange,
  kOverlooked,
  kOverlookedInPassing,
  kWeightCount
};

constexpr std::array<const char*, kWeightCount> kNames = {
    "hand at box", "hand sigma",   "hand floor",      "hand unseen",   "may visit",
    "may visit t", "dwell",        "visit window",    "out of reach",  "unobserved",
    "delay",       "carried",      "log unseen rate", "log unwatched", "false change",
    "overlooked",  "o. in passing"};

using Weights = std::array<double, kWeightCount>;

Weights PresentWeights() {
  return {weights::kHandAtBox,
          weights::kHandSigmaM,
          weights::kHandFloor,
          weights::kHandUnseen,
          weights::kMayVisit,
          weights::kMayVisitTime,
          weights::kDwell,
          weights::kVisitWindow,
          weights::kOutOfReach,
          weights::kUnobserved,
          weights::kDelay,
          weights::kCarried,
          std::log(weights::kUnseenRatePerS),
          std::log(weights::kUnwatchedRatePerS),
          weights::kFalseChange,
          weights::kOverlooked,
          weights::kOverlookedInPassing};
}

// How far a weight may well go from where it is.
Weights Scales() { return {1, 0.1, 1, 1, 1, 0.5, 0.4, 0.5, 1, 0.5, 0.5, 0.3, 1, 1, 1, 1, 1}; }

bool HasGap(const v1::InteractionCandidate& candidate) {
  for (const v1::Evidence& row : candidate.evidence()) {
    if (row.kind() != "unobserved") continue;
    return row.value() * static_cast<double>(row.to_ns() - row.from_ns()) * 1e-9 > 0.5;
  }
  return false;
}

double HandWeight(const v1::Evidence& row, bool has_gap, const Weights& w) {
  if (row.from_ns() != row.to_ns()) return w[kHandUnseen];
  const double deviations = row.value() / w[kHandSigma];
  return std::max(has_gap ? w[kHandUnseen] : w[kHandFloor],
                  w[kHandAtBox] - 0.5 * deviations * deviations);
}

double PriorWeight(const v1::Evidence& row, const ScoredChange& change,
                   const v1::InteractionCandidate& candidate, const Weights& w) {
  if (candidate.alternative() == query::kUnseen) {
    const double away_s = candidate.evidence_size() > 1 ? candidate.evidence(1).value() : 0.0;
    return std::log(std::exp(w[kUnseenRate]) * (row.value() - away_s) +
                    std::exp(w[kUnwatchedRate]) * away_s);
  }
  if (change.change.type() == v1::PLACED) {
    return change.is_robot_map ? w[kOverlookedInPassing] : w[kOverlooked];
  }
  return w[kFalseChange] + weights::kFalseChangePerObservation * row.value();
}

double LogOdds(const ScoredChange& change, const v1::InteractionCandidate& candidate,
               const Weights& w) {
  const bool has_gap = HasGap(candidate);
  const bool is_seen = candidate.evidence(0).kind() != "unobserved";
  double sum = 0.0;
  for (const v1::Evidence& row : candidate.evidence()) {
    const std::string& kind = row.kind();
    if (kind == "hand_distance") sum += HandWeight(row, has_gap, w);
    if (kind == "dwell") {
      const bool is_far = candidate.evidence_size() == 1;
      sum += is_far ? w[kOutOfReach]
                    : w[kDwell] * std::log1p(std::min(row.value(), weights::kDwellMaxS) / 2.0);
    }
    if (kind == "visit_window") sum += w[kVisitWindow] * row.value();
    if (kind == "unobserved" && !candidate.agent_id().empty()) {
      sum += is_seen ? w[kUnobserved] * row.value()
                     : w[kMayVisit] + w[kMayVisitTime] * std::log1p(row.value() / 2.0);
    }
    if (kind == "delay") sum += w[kDelay] * std::log1p(row.value() / 10.0);
    if (kind == "carried") sum += w[kCarried];
    if (kind == "prior") sum += PriorWeight(row, change, candidate, w);
  }
  return sum;
}

// A thing moved aside is no matter of who.
bool IsMoved(const ScoredChange& change) {
  for (const v1::InteractionCandidate& one : change.change.candidates()) {
    for (const v1::Evidence& row : one.evidence()) {
      if (row.kind() == "moved") return true;
    }
  }
  return false;
}

double Loss(const ScoredChange& change, const Weights& w) {
  double all = 0.0, right = 0.0;
  for (int i = 0; i < change.change.candidates_size(); ++i) {
    const double odds = std::exp(LogOdds(change, change.change.candidates(i), w));
    all += odds;
    if (change.did_it[i]) right += odds;
  }
  // Nobody is wholly wrong: identities may have been.
  return -std::log(0.99 * right / all + 0.01);
}

double Loss(const std::vector<ScoredChange>& changes, const Weights& w) {
  double sum = 0.0;
  for (const ScoredChange& change : changes) sum += Loss(change, w);
  const Weights present = PresentWeights();
  const Weights scales = Scales();
  for (size_t i = 0; i < w.size(); ++i) {
    const double away = (w[i] - present[i]) / scales[i];
    sum += 0.5 * away * away;
  }
  return sum;
}

Weights Fit(const std::vector<ScoredChange>& changes) {
  Weights best = PresentWeights();
  double least = Loss(changes, best);
  std::printf("%zu changes, loss %.2f each before", changes.size(),
              least / static_cast<double>(changes.size()));
  Weights steps = Scales();
  for (int round = 0; round < 60; ++round) {
    for (size_t i = 0; i < best.size(); ++i) {
      bool has_moved = false;
      for (const double sign : {1.0, -1.0}) {
        Weights next = best;
        next[i] += sign * steps[i];
        if (i == kHandSigma && next[i] < 0.05) continue;
        // Not to have been seen speaks for nobody.
        if (i == kUnobserved && next[i] > 0.0) continue;
        const double loss = Loss(changes, next);
        if (loss >= least) continue;
        least = loss;
        best = next;
        has_moved = true;
        break;
      }
      if (!has_moved) steps[i] *= 0.6;
    }
  }
  std::printf(", %.2f after\n", least / static_cast<double>(changes.size()));
  return best;
}

absl::Status Run(const std::vector<std::string>& arguments) {
  std::vector<ScoredChange> changes;
  for (const Tier tier : {Tier::kCameras, Tier::kGlances, Tier::kRobot}) {
    DSG_ASSIGN_OR_RETURN(const std::vector<PickWorldOptions> worlds,
                         ParsePickWorlds(arguments, tier));
    for (const PickWorldOptions& options : worlds) {
      if (options.world.seed > 10) {
        return absl::InvalidArgumentError("seeds from 11 on are kept for tests");
      }
      DSG_ASSIGN_OR_RETURN(PickWorld world, MakePickWorld(options));
      DSG_ASSIGN_OR_RETURN(const PickScore score, ScorePicks(std::move(world)));
      for (const auto* list : {&score.picked_changes, &score.placed_changes}) {
        for (const ScoredChange& change : *list) {
          if (!IsMoved(change)) changes.push_back(change);
        }
      }
    }
  }
  const Weights present = PresentWeights();
  const Weights fitted = Fit(changes);
  for (size_t i = 0; i < fitted.size(); ++i) {
    std::printf("%-16s %8.3f -> %8.3f\n", kNames[i], present[i], fitted[i]);
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace dsg::eval

int main(int argc, char** argv) {
  const absl::Status status = dsg::eval::Run({argv + 1, argv + argc});
  if (!status.ok()) std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  return status.ok() ? 0 : 1;
}
