// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/evidence.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "query/engine/interaction/carried.h"
#include "query/engine/interaction/hands.h"
#include "query/engine/interaction/track_path.h"
#include "query/engine/interaction/weights.h"
#include "schema/base/status.h"
#include "schema/model/edge.h"

namespace dsg::query {
namespace {

double Seconds(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<double>(TimeApart(from_ns, to_ns)) / static_cast<double>(kNsPerSecond);
}

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

void AddHand(const ObjectChange& change, NodeId agent, const Nearness& near, bool has_edge,
             Suspect* out) {
  const std::string source =
      has_edge ? absl::StrCat(ToString(agent), " NEAR ", ToString(change.object)) : ToString(agent);
  if (!near.hand_m.has_value()) {
    out->evidence.push_back({"hand_distance", weights::kHandUnseen, 0.0, near.visit.from_ns,
                             near.visit.to_ns, ToString(agent),
                             "no hand of theirs was seen while within reach"});
    return;
  }
  const double deviations = *near.hand_m / weights::kHandSigmaM;
  const double weight =
      std::max(weights::kHandFloor, weights::kHandAtBox - 0.5 * deviations * deviations);
  out->evidence.push_back(
      {"hand_distance", weight, *near.hand_m, near.hand_ns, near.hand_ns, source,
       absl::StrFormat("a hand came within %.2f m of the object", *near.hand_m)});
}

void AddVisit(const ObjectChange& change, NodeId agent, const Nearness& near, Suspect* out) {
  const std::string source = ToString(agent);
  out->evidence.push_back(
      {"dwell", weights::kDwell * std::log1p(near.dwell_s / 2.0), near.dwell_s, near.visit.from_ns,
       near.visit.to_ns, source,
       absl::StrFormat("spent %.1f s within %.1f m of the object", near.dwell_s, kDwellM)});
  const bool is_inside =
      near.visit.from_ns >= change.earliest_ns && near.visit.to_ns <= change.latest_ns;
  out->evidence.push_back({"visit_window", is_inside ? weights::kVisitWindow : 0.0,
                           is_inside ? 1.0 : 0.0, near.visit.from_ns, near.visit.to_ns,
                           ToString(change.object),
                           is_inside ? "came and went between the two looks at the object"
                                     : "was within reach at one of the two looks as well"});
  if (near.unobserved_share > 0.0) {
    out->evidence.push_back(
        {"unobserved", weights::kUnobserved * near.unobserved_share, near.unobserved_share,
         near.visit.from_ns, near.visit.to_ns, source,
         absl::StrFormat("%.0f %% of the visit was not observed", 100.0 * near.unobserved_share)});
  }
}

Suspect FalseChange(const ObjectChange& change, const std::vector<OtherEnd>& ends) {
  Suspect none;
  none.alternative = kFalseChange;
  none.at_ns = change.latest_ns;
  const auto count = static_cast<double>(std::min<int64_t>(change.observation_count, 10));
  none.evidence.push_back({"prior",
                           weights::kFalseChange + weights::kFalseChangePerObservation * count,
                           count, change.earliest_ns, change.latest_ns, ToString(change.object),
                           "the mapper may be wrong, the less the more often it saw the object"});
  for (const OtherEnd& end : ends) {
    if (end.distance_m > kReachM || end.room != change.room) continue;
    none.evidence.push_back(
        {"moved", weights::kMovedAside, end.distance_m, end.at_ns, end.at_ns,
         end.is_same_as ? absl::StrCat(ToString(change.object), " SAME_AS ", ToString(end.object))
                        : ToString(end.object),
         absl::StrFormat("a %s is %.1f m away in the same room: moved rather "
                         "than taken",
                         change.class_name, end.distance_m)});
    break;
  }
  return none;
}

// During the longest part of the interval nobody may have been looked at; each of its seconds
// counts alike.
Suspect Unseen(const ObjectChange& change, double seen_s) {
  Suspect unseen;
  unseen.alternative = kUnseen;
  unseen.at_ns = change.earliest_ns + (change.latest_ns - change.earliest_ns) / 2;
  const double alone_s = std::max(0.0, Seconds(change.earliest_ns, change.latest_ns) - seen_s);
  unseen.evidence.push_back(
      {"prior", std::log(weights::kUnseenRatePerS * std::max(alone_s, 1.0)), alone_s,
       change.earliest_ns, change.latest_ns, ToString(change.object),
       absl::StrFormat("for %.0f s nobody who was tracked was within reach", alone_s)});
  return unseen;
}

}  // namespace

absl::StatusOr<EvidenceFinder> EvidenceFinder::Make(const Snapshot& snapshot, const GraphView& view,
                                                    const std::vector<ObjectChange>& all) {
  EvidenceFinder finder(snapshot, view, all);
  DSG_ASSIGN_OR_RETURN(std::vector<TrackInfo> tracks, snapshot.Tracks());
  for (TrackInfo& track : tracks) finder.tracks_.emplace(track.agent, std::move(track));
  return finder;
}

absl::StatusOr<std::vector<NodeId>> EvidenceFinder::AgentsNear(const ObjectChange& change,
                                                               const StopCheck& stop) const {
  std::set<NodeId> agents;
  const TimeNs to_ns = AddTime(change.latest_ns, 1);
  if (!change.room.empty()) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                         snapshot_->StaysInNode(change.room, change.earliest_ns, to_ns, stop));
    for (const Stay& stay : stays) agents.insert(stay.agent);
  }
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kReachM);
  const Box3d box(change.box_map.min() - reach, change.box_map.max() + reach);
  DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                       snapshot_->VisitsToBox(box, change.earliest_ns, to_ns, stop));
  for (const BoxVisit& visit : visits) agents.insert(visit.agent);
  std::erase_if(agents, [&](NodeId agent) {
    const auto track = tracks_.find(agent);
    if (track == tracks_.end()) return true;
    return track->second.kind != kinds::kHuman && !IsHandEdge(*view_, agent, change.object);
  });
  return std::vector<NodeId>(agents.begin(), agents.end());
}

absl::StatusOr<Suspect> EvidenceFinder::Weigh(const ObjectChange& change, const TrackInfo& track,
                                              const std::vector<OtherEnd>& ends,
                                              const StopCheck& stop) const {
  Suspect candidate;
  candidate.agent = track.agent;
  const Interval during{change.earliest_ns, change.latest_ns};
  DSG_ASSIGN_OR_RETURN(Nearness near,
                       MeasureNearness(*snapshot_, track, change.box_map, during, stop));
  candidate.at_ns = near.torso_m.has_value() ? near.torso_ns : change.earliest_ns;
  if (!near.reached) {
    candidate.evidence.push_back(
        {"dwell", weights::kOutOfReach, near.torso_m.value_or(0.0), change.earliest_ns,
         change.latest_ns, ToString(track.agent),
         near.torso_m.has_value()
             ? absl::StrFormat("was in the room, but came no nearer than %.1f m", *near.torso_m)
             : std::string("was in the room, but no pose of theirs says where")});
    return candidate;
  }
  DSG_ASSIGN_OR_RETURN(const auto edge,
                       FindHandEdge(*snapshot_, track.agent, change.object, during));
  if (edge.has_value() && !near.hand_m.has_value()) {
    near.hand_m = edge->distance_m;
    near.hand_ns = edge->closest_ns;
  }
  if (near.hand_m.has_value()) candidate.at_ns = near.hand_ns;
  AddHand(change, track.agent, near, edge.has_value(), &candidate);
  AddVisit(change, track.agent, near, &candidate);
  for (const OtherEnd& end : ends) {
    const bool is_picked = change.type == ChangeType::kPicked;
    const TimeNs after_ns = is_picked ? near.visit.to_ns : AddTime(end.at_ns, -kNsPerSecond);
    const TimeNs until_ns = is_picked ? end.at_ns : near.visit.from_ns;
    DSG_ASSIGN_OR_RETURN(const auto visit_ns, FirstVisit(*snapshot_, track.agent, end.box_map,
                                                         after_ns, until_ns, stop));
    if (!visit_ns.has_value()) continue;
    candidate.evidence.push_back(
        {"carried", weights::kCarried, end.distance_m, *visit_ns, end.at_ns,
         end.is_same_as ? absl::StrCat(ToString(change.object), " SAME_AS ", ToString(end.object))
                        : ToString(end.object),
         absl::StrFormat("was also where a %s %s, %.1f m from here", change.class_name,
                         is_picked ? "appeared afterwards" : "was taken before", end.distance_m)});
    break;
  }
  return candidate;
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
  const std::vector<OtherEnd> ends = FindOtherEnds(*view_, change, *all_);
  DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> agents, AgentsNear(change, stop));
  std::vector<Suspect> candidates;
  double seen_s = 0.0;
  for (const NodeId agent : agents) {
    DSG_ASSIGN_OR_RETURN(Suspect candidate, Weigh(change, tracks_.at(agent), ends, stop));
    for (const EvidenceRow& row : candidate.evidence) {
      if (row.kind == "visit_window") seen_s += Seconds(row.from_ns, row.to_ns);
    }
    candidates.push_back(std::move(candidate));
  }
  candidates.push_back(Unseen(change, seen_s));
  candidates.push_back(FalseChange(change, ends));
  std::vector<SameAgent> same = Identities(candidates);
  return Judge(std::move(candidates), std::move(same));
}

}  // namespace dsg::query
