// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/evidence.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "query/engine/interaction/hands.h"
#include "query/engine/interaction/object_change.h"
#include "query/engine/interaction/track_path.h"
#include "query/engine/interaction/verdict.h"
#include "query/engine/interaction/weights.h"
#include "schema/base/status.h"
#include "schema/model/edge.h"

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

double SecondsBetween(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<double>(TimeApart(from_ns, to_ns)) / static_cast<double>(kNsPerSecond);
}

// Of a visit that was seen: how near a hand came. `has_edge`: a NEAR edge tells of it.
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

// Of a visit that was seen: how long, between the two looks at the object or not, and how much of
// it was not observed.
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

// Of a visit that nobody saw.
void AddPossibleVisit(NodeId agent, const Visit& visit, Suspect* out) {
  const double weight =
      weights::kMayVisit + weights::kMayVisitTime * std::log1p(visit.unseen_s / 2.0);
  out->evidence.push_back(
      {"unobserved", weight, visit.unseen_s, visit.during.from_ns, visit.during.to_ns,
       ToString(agent),
       absl::StrFormat("may have been within reach for %.1f s, while nobody looked",
                       visit.unseen_s)});
}

// Of a put object: how long after `out->at_ns` it was first seen.
void AddDelay(const ObjectChange& change, Suspect* out) {
  const double delay_s = SecondsBetween(out->at_ns, change.latest_ns);
  out->evidence.push_back({"delay", weights::kDelay * std::log1p(delay_s / kDelayS), delay_s,
                           out->at_ns, change.latest_ns, ToString(change.object),
                           absl::StrFormat("the object was first seen %.1f s later", delay_s)});
}

// Of whom the object was seen with.
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

// Somebody whom no pose has within reach, and who held the object all the same.
Suspect Holder(const ObjectChange& change, const Hold& hold) {
  Suspect holder;
  holder.agent = hold.agent;
  const bool is_picked = change.type == ChangeType::kPicked;
  holder.at_ns = std::clamp(is_picked ? hold.during.from_ns : hold.during.to_ns, change.earliest_ns,
                            change.latest_ns);
  AddHeld(change, hold, &holder);
  return holder;
}

// Nothing happened: the mapper was wrong, or the object is beside its old spot; not so where it
// was seen in a hand, as probably as that is.
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

// Somebody whom nobody saw, in all of the interval but `seen_s`; during `away_s` of it the map's
// robots were elsewhere.
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

// Who is about at that time, and so far away, may have come near while nobody looked.
constexpr double kAboutM = 4.0;
// A robot sees what people do so far away, along the floor.
constexpr double kWatchM = 6.0;

bool IsHandEdge(const GraphView& view, NodeId agent, NodeId object) {
  const std::optional<Symbol> near = view.symbols().Find(relations::kNear);
  bool found = false;
  if (!near.has_value()) return false;
  view.ForEachEdgeFrom(agent, *near, [&](const ViewEdge& edge) {
    found = edge.target == object;
    return !found;
  });
  return found;
}

// What the map's own NEAR edge says, where no shapes were stored.
struct HandEdge {
  double distance_m = 0.0;
  TimeNs closest_ns = 0;
};

absl::StatusOr<std::optional<HandEdge>> FindHandEdge(const Snapshot& snapshot, NodeId agent,
                                                     NodeId object, const Interval& during) {
  DSG_ASSIGN_OR_RETURN(const std::optional<Edge> edge,
                       snapshot.FindEdge({agent, relations::kNear, object}));
  if (!edge.has_value() || !edge->valid.Overlaps(during)) return std::nullopt;
  const auto contact = edge->attributes.find("contact");
  if (contact == edge->attributes.end() || contact->second != AttributeValue("hand")) {
    return std::nullopt;
  }
  HandEdge hand{edge->weight, std::max(edge->valid.from_ns, during.from_ns)};
  const auto closest = edge->attributes.find("closest_ns");
  if (closest != edge->attributes.end()) {
    const auto* text = std::get_if<std::string>(&closest->second);
    const auto time =
        text != nullptr ? ParseTime(*text, 0) : absl::StatusOr<TimeNs>(hand.closest_ns);
    // The closest instant may lie outside the interval; what is known of this one is less then.
    if (time.ok() && (*time < during.from_ns || *time > during.to_ns)) return std::nullopt;
    if (time.ok()) hand.closest_ns = *time;
  }
  return hand;
}

const Hold* FindHold(const std::vector<Hold>& holds, NodeId agent) {
  const auto hold =
      std::find_if(holds.begin(), holds.end(), [&](const Hold& one) { return one.agent == agent; });
  return hold == holds.end() ? nullptr : &*hold;
}

// Whether it may have been taken at this visit to be held then, or put after that.
bool IsBeforeOrWhile(const ObjectChange& change, const Visit& visit, const Hold& hold) {
  if (!visit.is_seen) return false;
  return change.type == ChangeType::kPicked ? visit.during.from_ns <= hold.during.to_ns
                                            : visit.during.to_ns >= hold.during.from_ns;
}

// What came before and after the instant at which the agent is thought to have been there.
void AddWay(const ObjectChange& change, const std::vector<OtherEnd>& ends, Suspect* out) {
  const bool is_picked = change.type == ChangeType::kPicked;
  if (!is_picked) AddDelay(change, out);
  for (const OtherEnd& end : ends) {
    const TimeNs after_ns = is_picked ? out->at_ns : AddTime(end.at_ns, -kNsPerSecond);
    const TimeNs until_ns = is_picked ? end.at_ns : out->at_ns;
    const std::optional<TimeNs> visit_ns = FirstVisit(end, out->agent, after_ns, until_ns);
    if (!visit_ns.has_value()) continue;
    out->evidence.push_back(
        {"carried", weights::kCarried, end.distance_m, *visit_ns, end.at_ns,
         end.is_same_as ? absl::StrCat(ToString(change.object), " SAME_AS ", ToString(end.object))
                        : ToString(end.object),
         absl::StrFormat("was also where a %s %s, %.1f m from here", change.class_name,
                         is_picked ? "appeared afterwards" : "was taken before", end.distance_m)});
    break;
  }
}

}  // namespace

absl::StatusOr<EvidenceFinder> EvidenceFinder::Make(const Snapshot& snapshot, const GraphView& view,
                                                    const std::vector<ObjectChange>& all) {
  EvidenceFinder finder(snapshot, view, all);
  DSG_ASSIGN_OR_RETURN(std::vector<TrackInfo> tracks, snapshot.Tracks());
  for (TrackInfo& track : tracks) finder.tracks_.emplace(track.agent, std::move(track));
  return finder;
}

absl::StatusOr<std::map<NodeId, bool>> EvidenceFinder::AgentsNear(const ObjectChange& change,
                                                                  const StopCheck& stop) const {
  std::map<NodeId, bool> agents;
  const TimeNs from_ns = AddTime(change.earliest_ns, -kAboutNs);
  const TimeNs to_ns = AddTime(change.latest_ns, kAboutNs);
  const auto add = [&](NodeId agent, TimeNs enter_ns, TimeNs exit_ns) {
    bool& was_there = agents[agent];
    was_there = was_there || (enter_ns <= change.latest_ns && exit_ns > change.earliest_ns);
  };
  if (!change.room.empty()) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                         snapshot_->StaysInNode(change.room, from_ns, to_ns, stop));
    for (const Stay& stay : stays) add(stay.agent, stay.enter_ns, stay.exit_ns);
  }
  const Eigen::Vector3d about = Eigen::Vector3d::Constant(kAboutM);
  const Box3d box(change.box_map.min() - about, change.box_map.max() + about);
  DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                       snapshot_->VisitsToBox(box, from_ns, to_ns, stop));
  for (const BoxVisit& visit : visits) agents.try_emplace(visit.agent, false);
  std::erase_if(agents, [&](const auto& agent) {
    const auto track = tracks_.find(agent.first);
    if (track == tracks_.end()) return true;
    return track->second.kind != kinds::kHuman && !IsHandEdge(*view_, agent.first, change.object);
  });
  return agents;
}

absl::StatusOr<Suspect> EvidenceFinder::WeighVisit(const ObjectChange& change, NodeId agent,
                                                   const Leads& leads, Visit visit) const {
  const Hold* const hold = FindHold(leads.holds, agent);
  Suspect candidate;
  candidate.agent = agent;
  candidate.at_ns = visit.is_seen
                        ? visit.torso_ns
                        : visit.during.from_ns + (visit.during.to_ns - visit.during.from_ns) / 2;
  DSG_ASSIGN_OR_RETURN(const auto edge,
                       FindHandEdge(*snapshot_, agent, change.object, visit.during));
  if (edge.has_value() && !visit.hand_m.has_value()) {
    visit.hand_m = edge->distance_m;
    visit.hand_ns = edge->closest_ns;
  }
  if (visit.hand_m.has_value()) candidate.at_ns = visit.hand_ns;
  if (visit.is_seen || visit.hand_m.has_value()) {
    AddHand(change, agent, visit, edge.has_value(), &candidate);
    AddVisit(change, agent, visit, &candidate);
  } else {
    candidate.was_near = false;
    AddPossibleVisit(agent, visit, &candidate);
  }
  if (hold != nullptr && IsBeforeOrWhile(change, visit, *hold)) AddHeld(change, *hold, &candidate);
  AddWay(change, leads.ends, &candidate);
  return candidate;
}

absl::StatusOr<std::optional<Suspect>> EvidenceFinder::Weigh(const ObjectChange& change,
                                                             const TrackInfo& track,
                                                             const Leads& leads, bool was_there,
                                                             const StopCheck& stop,
                                                             double* seen_s) const {
  const Interval during{change.earliest_ns, change.latest_ns};
  DSG_ASSIGN_OR_RETURN(const Nearness near,
                       MeasureNearness(*snapshot_, track, change.box_map, during, stop));
  std::optional<Suspect> best;
  // Who had it in hand was there, whoever looked.
  if (const Hold* const hold = FindHold(leads.holds, track.agent); hold != nullptr) {
    best = Holder(change, *hold);
    AddWay(change, leads.ends, &*best);
  }
  for (const Visit& visit : near.visits) {
    DSG_ASSIGN_OR_RETURN(Suspect candidate, WeighVisit(change, track.agent, leads, visit));
    if (visit.is_seen) *seen_s += SecondsBetween(visit.during.from_ns, visit.during.to_ns);
    if (best.has_value() && candidate.LogOdds() <= best->LogOdds()) continue;
    best = std::move(candidate);
  }
  if (best.has_value() || !was_there) return best;
  Suspect candidate;
  candidate.agent = track.agent;
  candidate.was_near = false;
  candidate.at_ns = near.torso_m.has_value() ? near.torso_ns : change.earliest_ns;
  candidate.evidence.push_back(
      {"dwell", weights::kOutOfReach, near.torso_m.value_or(0.0), change.earliest_ns,
       change.latest_ns, ToString(track.agent),
       near.torso_m.has_value()
           ? absl::StrFormat("was in the room, but came no nearer than %.1f m", *near.torso_m)
           : std::string("was in the room, but no pose of theirs says where")});
  return candidate;
}

absl::StatusOr<double> EvidenceFinder::SecondsAway(const ObjectChange& change,
                                                   const StopCheck& stop) const {
  const auto is_robot = [](const auto& track) {
    return track.second.kind == kinds::kRobot && track.second.pose_count > 1;
  };
  if (std::none_of(tracks_.begin(), tracks_.end(), is_robot)) return 0.0;
  const Eigen::Vector3d watch = Eigen::Vector3d::Constant(kWatchM);
  const Box3d box(change.box_map.min() - watch, change.box_map.max() + watch);
  DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                       snapshot_->VisitsToBox(box, change.earliest_ns, change.latest_ns, stop));
  double away_s = SecondsBetween(change.earliest_ns, change.latest_ns);
  for (const BoxVisit& visit : visits) {
    const auto track = tracks_.find(visit.agent);
    if (track == tracks_.end() || !is_robot(*track)) continue;
    away_s -= SecondsBetween(visit.enter_ns, visit.exit_ns);
  }
  return std::max(0.0, away_s);
}

std::vector<SameAgent> EvidenceFinder::Identities(const std::vector<Suspect>& candidates) const {
  std::vector<SameAgent> same;
  const std::optional<Symbol> relation = view_->symbols().Find(relations::kSameAs);
  if (!relation.has_value()) return same;
  std::set<NodeId> pending, seen;
  for (const Suspect& one : candidates) {
    if (!one.agent.empty()) pending.insert(one.agent);
  }
  while (!pending.empty()) {
    const NodeId agent = *pending.begin();
    pending.erase(pending.begin());
    if (!seen.insert(agent).second) continue;
    view_->ForEachEdgeFrom(agent, *relation, [&](const ViewEdge& edge) {
      if (!tracks_.contains(edge.target)) return true;
      same.push_back({agent, edge.target, edge.weight});
      pending.insert(edge.target);
      return true;
    });
  }
  return same;
}

absl::StatusOr<Verdict> EvidenceFinder::Examine(const ObjectChange& change,
                                                const StopCheck& stop) const {
  Leads leads;
  DSG_ASSIGN_OR_RETURN(leads.ends, FindOtherEnds(*snapshot_, *view_, change, *all_, stop));
  leads.holds = FindHolds(*view_, change);
  DSG_ASSIGN_OR_RETURN(auto agents, AgentsNear(change, stop));
  for (const Hold& hold : leads.holds) {
    if (tracks_.contains(hold.agent)) agents.try_emplace(hold.agent, false);
  }
  std::vector<Suspect> candidates;
  double seen_s = 0.0;
  for (const auto& [agent, was_there] : agents) {
    DSG_ASSIGN_OR_RETURN(std::optional<Suspect> candidate,
                         Weigh(change, tracks_.at(agent), leads, was_there, stop, &seen_s));
    if (candidate.has_value()) candidates.push_back(*std::move(candidate));
  }
  DSG_ASSIGN_OR_RETURN(const double away_s, SecondsAway(change, stop));
  candidates.push_back(Unseen(change, seen_s, away_s));
  candidates.push_back(FalseChange(change, leads.ends, leads.holds));
  std::vector<SameAgent> same = Identities(candidates);
  return Judge(std::move(candidates), std::move(same));
}

}  // namespace dsg::query
