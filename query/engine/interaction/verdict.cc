// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/verdict.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "query/engine/interaction/weights.h"

namespace dsg::query {
namespace {

void Normalise(std::vector<Suspect>* candidates) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Suspect& one : *candidates) highest = std::max(highest, one.LogOdds());
  double sum = 0.0;
  for (Suspect& one : *candidates) {
    one.probability = std::exp(one.LogOdds() - highest);
    sum += one.probability;
  }
  for (Suspect& one : *candidates) one.probability /= sum;
}

// The evidence of the later track is the earlier one's with this probability.
void Share(const SameAgent& same, std::vector<Suspect>* candidates) {
  const auto find = [&](NodeId agent) {
    return std::find_if(candidates->begin(), candidates->end(),
                        [&](const Suspect& one) { return one.agent == agent; });
  };
  const auto later = find(same.later);
  const double probability = std::clamp(same.probability, 0.0, 1.0);
  if (later == candidates->end() || probability == 0.0) return;
  const double moved = probability * later->probability;
  EvidenceRow row{"identity",
                  0.0,
                  probability,
                  later->at_ns,
                  later->at_ns,
                  absl::StrCat(ToString(same.later), " SAME_AS ", ToString(same.earlier)),
                  absl::StrFormat("%s is %s, seen again, with probability %.2f",
                                  ToString(same.later), ToString(same.earlier), probability)};
  const TimeNs at_ns = later->at_ns;
  const bool was_near = later->was_near;
  row.log_weight = std::log(std::max(1.0 - probability, 1e-6));
  later->probability -= moved;
  later->evidence.push_back(row);
  auto earlier = find(same.earlier);
  if (earlier == candidates->end()) {
    Suspect added;
    added.agent = same.earlier;
    added.at_ns = at_ns;
    added.was_near = was_near;
    candidates->push_back(std::move(added));
    earlier = candidates->end() - 1;
  }
  row.log_weight = std::log1p(moved / std::max(earlier->probability, 1e-6));
  earlier->was_near = earlier->was_near || was_near;
  if (moved > earlier->probability) earlier->at_ns = at_ns;
  earlier->probability += moved;
  earlier->evidence.push_back(std::move(row));
}

void Decide(Verdict* verdict) {
  const std::vector<Suspect>& all = verdict->candidates;
  const Suspect& best = all.front();
  const double margin = best.probability - (all.size() > 1 ? all[1].probability : 0.0);
  verdict->abstained = true;
  if (best.probability >= weights::kProbabilityMin && margin >= weights::kMarginMin) {
    verdict->abstained = best.agent.empty();
    if (best.alternative == kUnseen) {
      verdict->reason = "most likely somebody whom nobody saw";
    } else if (best.alternative == kFalseChange) {
      verdict->reason = "most likely nothing was taken or put";
    } else if (!best.was_near) {
      verdict->abstained = true;
      verdict->reason = absl::StrCat("the best, ", ToString(best.agent),
                                     ", was about, but nobody saw it within reach");
    }
    return;
  }
  const auto name = [](const Suspect& one) {
    return one.agent.empty() ? one.alternative : ToString(one.agent);
  };
  verdict->reason =
      absl::StrFormat("the best, %s, has probability %.2f", name(best), best.probability);
  if (all.size() > 1) {
    absl::StrAppendFormat(&verdict->reason, ", the next, %s, %.2f", name(all[1]),
                          all[1].probability);
  }
}

}  // namespace

double Suspect::LogOdds() const {
  double sum = 0.0;
  for (const EvidenceRow& row : evidence) sum += row.log_weight;
  return sum;
}

Verdict Judge(std::vector<Suspect> candidates, std::vector<SameAgent> same) {
  Verdict verdict;
  Normalise(&candidates);
  std::sort(same.begin(), same.end(), [](const SameAgent& a, const SameAgent& b) {
    return std::tuple(b.later, b.earlier) < std::tuple(a.later, a.earlier);
  });
  for (const SameAgent& one : same) Share(one, &candidates);
  std::sort(candidates.begin(), candidates.end(), [](const Suspect& a, const Suspect& b) {
    return std::tuple(-a.probability, a.agent.empty(), a.agent, a.alternative) <
           std::tuple(-b.probability, b.agent.empty(), b.agent, b.alternative);
  });
  verdict.candidates = std::move(candidates);
  Decide(&verdict);
  return verdict;
}

}  // namespace dsg::query
