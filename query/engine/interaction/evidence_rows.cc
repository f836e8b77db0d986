// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/evidence_rows.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "query/engine/interaction/track_path.h"
#include "query/engine/interaction/weights.h"

namespace dsg::query {
namespace {

// Less is between two pictures.
constexpr double kHandGapS = 0.5;
constexpr double kDelayS = 10.0;
// A mapper whose object is moved or lost finds it again when it looks at the old spot, which is
// when it misses it; where it stood, it may be in doubt for a while.
constexpr double kSameSpotM = 0.15;
constexpr TimeNs kMovedNs = 20 * kNsPerSecond;
constexpr TimeNs kFoundAnewNs = 60 * kNsPerSecond;
// What stood there earlier than this before the other was missed is not the other.
constexpr TimeNs kLookNs = 2 * kNsPerSecond;

// How much the other end, within reach of there, says that nothing was taken or put; 0 = nothing.
double MovedWeight(const ObjectChange& change, const OtherEnd& end) {
  if (end.distance_m > kReachM || end.room != change.room) return 0.0;
  if (end.is_same_as) return weights::kFoundAnew;
  if (end.is_held) return 0.0;
  const bool is_picked = change.type == ChangeType::kPicked;
  const TimeNs missed_ns = is_picked ? change.latest_ns : end.noticed_ns;
  const TimeNs appeared_ns = is_picked ? end.noticed_ns : change.latest_ns;
  const bool is_same_spot = (end.box_map.center() - change.box_map.center()).norm() <= kSameSpotM;
  if (is_same_spot && appeared_ns >= AddTime(missed_ns, -kFoundAnewNs) &&
      appeared_ns <= AddTime(missed_ns, kFoundAnewNs)) {
    return weights::kFoundAnew;
  }
  // Whoever looks for it sees the one with the other.
  const bool is_one_look =
      appeared_ns >= AddTime(missed_ns, -kLookNs) && appeared_ns <= AddTime(missed_ns, kMovedNs);
  return is_one_look ? weights::kMovedAside : 0.0;
}

void AddMoved(const ObjectChange& change, const std::vector<OtherEnd>& ends, Suspect* out) {
  const OtherEnd* best = nullptr;
  double weight = 0.0;
  for (const OtherEnd& end : ends) {
    const double moved = MovedWeight(change, end);
    if (moved <= weight) continue;
    weight = moved;
    best = &end;
  }
  if (best == nullptr) return;
  out->evidence.push_back(
      {"moved", weight, best->distance_m, best->at_ns, best->at_ns,
       best->is_same_as ? absl::StrCat(ToString(change.object), " SAME_AS ", ToString(best->object))
                        : ToString(best->object),
       absl::StrFormat("a %s is %.1f m away in the same room: moved rather than taken",
                       change.class_name, best->distance_m)});
}

std::string SourceOf(const Hold& hold) {
  return absl::StrCat(ToString(hold.object), " HELD_BY ", ToString(hold.agent));
}

// Of a thing that was seen in a hand for certain, edges may still be wrong.
double HeldWeight(double probability) {
  if (probability >= 1.0) return weights::kHeldMax;
  return std::min(weights::kHeldMax, std::log(probability / (1.0 - probability)));
}

}  // namespace

double SecondsBetween(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<double>(TimeApart(from_ns, to_ns)) / static_cast<double>(kNsPerSecond);
}

void AddHand(const ObjectChange& change, NodeId agent, const Visit& visit, bool has_edge,
             Suspect* out) {
  const std::string source =
      has_edge ? absl::StrCat(ToString(agent), " NEAR ", ToString(change.object)) : ToString(agent);
  if (!visit.hand_m.has_value()) {
    out->evidence.push_back({"hand_distance", weights::kHandUnseen, 0.0, visit.during.from_ns,
                             visit.during.to_ns, ToString(agent),
                             "no hand of theirs was seen while within reach"});
    return;
  }
  const double deviations = *visit.hand_m / weights::kHandSigmaM;
  // While nobody looked, hands may have been anywhere.
  const double floor = visit.unseen_s > kHandGapS ? weights::kHandUnseen : weights::kHandFloor;
  const double weight = std::max(floor, weights::kHandAtBox - 0.5 * deviations * deviations);
  out->evidence.push_back(
      {"hand_distance", weight, *visit.hand_m, visit.hand_ns, visit.hand_ns, source,
       absl::StrFormat("a hand came within %.2f m of the object", *visit.hand_m)});
}

void AddVisit(const ObjectChange& change, NodeId agent, const Visit& visit, Suspect* out) {
  const auto [from_ns, to_ns] = visit.during;
  const std::string source = ToString(agent);
  out->evidence.push_back(
      {"dwell", weights::kDwell * std::log1p(std::min(visit.dwell_s, weights::kDwellMaxS) / 2.0),
       visit.dwell_s, from_ns, to_ns, source,
       absl::StrFormat("spent %.1f s within %.1f m of the object", visit.dwell_s, kDwellM)});
  const Interval seen = visit.is_seen ? visit.seen : visit.during;
  const bool is_inside = seen.from_ns > change.earliest_ns && seen.to_ns < change.latest_ns;
  out->evidence.push_back({"visit_window", is_inside ? weights::kVisitWindow : 0.0,
                           is_inside ? 1.0 : 0.0, seen.from_ns, seen.to_ns, ToString(change.object),
                           is_inside ? "came and went between the two looks at the object"
                                     : "was within reach at one of the two looks as well"});
  if (visit.unseen_s <= 0.0) return;
  const double share =
      std::min(1.0, visit.unseen_s / std::max(1e-9, SecondsBetween(from_ns, to_ns)));
  out->evidence.push_back(
      {"unobserved", weights::kUnobserved * share, share, from_ns, to_ns, source,
       absl::StrFormat("%.0f %% of the visit was not observed", 100.0 * share)});
}

void AddPossibleVisit(NodeId agent, const Visit& visit, Suspect* out) {
  const double weight =
      weights::kMayVisit + weights::kMayVisitTime * std::log1p(visit.unseen_s / 2.0);
  out->evidence.push_back(
      {"unobserved", weight, visit.unseen_s, visit.during.from_ns, visit.during.to_ns,
       ToString(agent),
       absl::StrFormat("may have been within reach for %.1f s, while nobody looked",
                       visit.unseen_s)});
}

void AddDelay(const ObjectChange& change, Suspect* out) {
  const double delay_s = SecondsBetween(out->at_ns, change.latest_ns);
  out->evidence.push_back({"delay", weights::kDelay * std::log1p(delay_s / kDelayS), delay_s,
                           out->at_ns, change.latest_ns, ToString(change.object),
                           absl::StrFormat("the object was first seen %.1f s later", delay_s)});
}

void AddHeld(const ObjectChange& change, const Hold& hold, Suspect* out) {
  out->was_near = true;
  const std::string before = hold.object == change.object
                                 ? std::string()
                                 : absl::StrCat(", ", ToString(hold.object), " then");
  out->evidence.push_back(
      {"held", HeldWeight(hold.probability), hold.probability, hold.during.from_ns,
       hold.during.to_ns, SourceOf(hold),
       absl::StrFormat("was seen with the object in hand%s, with probability %.2f", before,
                       hold.probability)});
}

Suspect Holder(const ObjectChange& change, const Hold& hold) {
  Suspect holder;
  holder.agent = hold.agent;
  const bool is_picked = change.type == ChangeType::kPicked;
  holder.at_ns = std::clamp(is_picked ? hold.during.from_ns : hold.during.to_ns, change.earliest_ns,
                            change.latest_ns);
  AddHeld(change, hold, &holder);
  return holder;
}

Suspect FalseChange(const ObjectChange& change, const std::vector<OtherEnd>& ends,
                    const std::vector<Hold>& holds) {
  Suspect none;
  none.alternative = kFalseChange;
  none.at_ns = change.latest_ns;
  const auto count = static_cast<double>(std::min<int64_t>(change.observation_count, 10));
  const std::string source = ToString(change.object);
  if (change.type == ChangeType::kPicked) {
    none.evidence.push_back({"prior",
                             weights::kFalseChange + weights::kFalseChangePerObservation * count,
                             count, change.earliest_ns, change.latest_ns, source,
                             "the mapper may be wrong, the less the more often it saw the object"});
  } else {
    none.evidence.push_back(
        {"prior", change.is_passed_by ? weights::kOverlookedInPassing : weights::kOverlooked, count,
         change.earliest_ns, change.latest_ns, source,
         "the mapper may have overlooked the object until then"});
  }
  const auto likeliest =
      std::max_element(holds.begin(), holds.end(),
                       [](const Hold& a, const Hold& b) { return a.probability < b.probability; });
  if (likeliest == holds.end()) {
    AddMoved(change, ends, &none);
    return none;
  }
  const double left = std::log1p(-std::min(likeliest->probability, 1.0));
  none.evidence.push_back({"held", std::max(-weights::kHeldMax, left), likeliest->probability,
                           likeliest->during.from_ns, likeliest->during.to_ns, SourceOf(*likeliest),
                           "the object was seen in somebody's hand"});
  return none;
}

// During the longest part of the interval nobody may have been looked at; each second counts, and
// more where there was nobody to look.
Suspect Unseen(const ObjectChange& change, double seen_s, double away_s) {
  Suspect unseen;
  unseen.alternative = kUnseen;
  unseen.at_ns = change.earliest_ns + (change.latest_ns - change.earliest_ns) / 2;
  const double alone_s =
      std::max(1.0, SecondsBetween(change.earliest_ns, change.latest_ns) - seen_s);
  const double rate = std::log(weights::kUnseenRatePerS * alone_s);
  unseen.evidence.push_back(
      {"prior", rate, alone_s, change.earliest_ns, change.latest_ns, ToString(change.object),
       absl::StrFormat("for %.0f s nobody who was tracked was within reach", alone_s)});
  if (away_s <= 0.0) return unseen;
  away_s = std::min(away_s, alone_s);
  const double both = std::log(weights::kUnseenRatePerS * (alone_s - away_s) +
                               weights::kUnwatchedRatePerS * away_s);
  unseen.evidence.push_back(
      {"unobserved", both - rate, away_s, change.earliest_ns, change.latest_ns,
       ToString(change.object),
       absl::StrFormat("for %.0f s of that no robot was near to see anybody", away_s)});
  return unseen;
}

}  // namespace dsg::query
