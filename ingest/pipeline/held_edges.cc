// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/held_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace dsg::ingest {
namespace {

constexpr OptionField<HeldOptions> kHeldFields[] = {
    {"held-hand", &HeldOptions::hand_m, 0.1, 10.0,
     "A thing is carried by whose torso is this near along the floor, metres: an arm, and what "
     "torsos err by"},
    {"held-share", &HeldOptions::beside_share, 0.0, 1.0,
     "... at this share of the places where it was seen: torsos are unseen at some"},
    {"held-visit", &HeldOptions::visit_m, 0.1, 10.0,
     "Who comes this near to a thing may take it, metres: an arm over the edge of a table"},
    {"held-gap", &HeldOptions::gap_ns_max, 0.0, 3600.0,
     "Between sightings farther apart nobody knows where a torso was, seconds: a step or two"},
    {"held-missed", &HeldOptions::missed_factor, 1.0, 1000.0,
     "How many times likelier a thing is the carried one when it was found missing: looks miss "
     "things"},
    {"held-visited", &HeldOptions::visited_factor, 1.0, 1000.0,
     "The same when the person came by just before: it tells more than a look"},
    {"held-visit-fades", &HeldOptions::visit_fades_s, 0.1, 86400.0,
     "How long such a visit tells, seconds: after half a minute others have come by"},
    {"held-unknown", &HeldOptions::unknown_weight, 0.0, 100.0,
     "How likely it is that the map never held the thing, of a thing at the same place: bags and "
     "pockets"},
    {"held-near", &HeldOptions::near_m, 0.1, 1000.0,
     "Things this much farther away are e times less likely, metres: they are taken from the same "
     "room or the next"},
    {"held-walk", &HeldOptions::walk_mps, 0.1, 100.0,
     "How fast things are carried at most, metres / second: a walk"},
    {"held-probability", &HeldOptions::probability_min, 0.0, 1.0,
     "Least probability that is told: more likely than all others together, with a margin"},
};

double AlongFloor(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).head<2>().norm();
}

// Where a torso was; nullopt while it was not seen.
std::optional<Eigen::Vector3d> TorsoAt(const AgentPath& path, TimeNs time_ns, TimeNs gap_ns_max) {
  const auto after = std::lower_bound(
      path.torso.begin(), path.torso.end(), time_ns,
      [](const TimedPoint& point, TimeNs wanted_ns) { return point.time_ns < wanted_ns; });
  if (after == path.torso.end()) return std::nullopt;
  if (after->time_ns == time_ns) return after->position_map;
  if (after == path.torso.begin()) return std::nullopt;
  const TimedPoint& before = *std::prev(after);
  const TimeNs gap_ns = after->time_ns - before.time_ns;
  if (gap_ns > gap_ns_max) return std::nullopt;
  const double share = static_cast<double>(time_ns - before.time_ns) / static_cast<double>(gap_ns);
  return before.position_map + share * (after->position_map - before.position_map);
}

// Index of the person beside whom a thing went, -1 = nobody.
int HolderOf(const std::vector<AgentPath>& people, const Carry& carry, const HeldOptions& options) {
  int holder = -1;
  double least_m = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < people.size(); ++i) {
    double sum_m = 0.0;
    int beside_count = 0;
    for (const Carry::Point& point : carry.way) {
      const auto torso_map = TorsoAt(people[i], point.time_ns, options.gap_ns_max);
      if (!torso_map.has_value()) continue;
      const double distance_m = AlongFloor(*torso_map, point.position_map);
      if (distance_m > options.hand_m) continue;
      sum_m += distance_m;
      ++beside_count;
    }
    if (beside_count < options.beside_share * static_cast<double>(carry.way.size())) continue;
    if (sum_m / beside_count >= least_m) continue;
    least_m = sum_m / beside_count;
    holder = static_cast<int>(i);
  }
  return holder;
}

struct Approach {
  double distance_m = std::numeric_limits<double>::infinity();
  TimeNs time_ns = 0;
};

// How near a torso was seen to an object during an interval.
Approach NearestApproach(const AgentPath& path, const Node& object, TimeNs from_ns, TimeNs to_ns) {
  Approach nearest;
  for (const TimedPoint& point : path.torso) {
    if (point.time_ns < from_ns || point.time_ns > to_ns) continue;
    const double distance_m = AlongFloor(point.position_map, object.map_T_node.position);
    if (distance_m < nearest.distance_m) nearest = {distance_m, point.time_ns};
  }
  return nearest;
}

struct Candidate {
  const Node* object = nullptr;
  double weight = 0.0;
  Approach approach;
};

double Seconds(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<double>(to_ns - from_ns) / kNsPerSecond;
}

// The best, its weight made a probability; nullptr when none is probable enough.
Candidate BestOf(const std::vector<Candidate>& candidates, const HeldOptions& options) {
  Candidate best;
  double sum = options.unknown_weight;
  for (const Candidate& candidate : candidates) {
    sum += candidate.weight;
    if (candidate.weight > best.weight) best = candidate;
  }
  if (best.object == nullptr || best.weight <= options.probability_min * sum) return {};
  best.weight /= sum;
  return best;
}

TimeNs FirstSeen(const Node& object) {
  return object.first_observed_ns.value_or(object.valid.from_ns);
}

// What the thing was before.
Candidate OriginOf(const Carry& carry, const AgentPath& holder, const std::vector<Node>& objects,
                   const HeldOptions& options) {
  const TimeNs begin_ns = carry.way.front().time_ns;
  std::vector<Candidate> candidates;
  for (const Node& object : objects) {
    const TimeNs last_ns = object.last_observed_ns.value_or(object.valid.from_ns);
    if (object.class_id != carry.class_id || FirstSeen(object) >= begin_ns || last_ns >= begin_ns) {
      continue;
    }
    const double way_m = AlongFloor(object.map_T_node.position, carry.way.front().position_map);
    if (way_m > options.visit_m + options.walk_mps * Seconds(last_ns, begin_ns)) continue;
    Candidate candidate{&object, std::exp(-way_m / options.near_m), {}};
    // Who came when it was missing already did not take it.
    const TimeNs until_ns = std::min(begin_ns, object.valid.to_ns);
    candidate.approach = NearestApproach(holder, object, last_ns, until_ns);
    if (object.valid.to_ns != kTimeMax) candidate.weight *= options.missed_factor;
    if (candidate.approach.distance_m <= options.visit_m) {
      const double fading =
          std::exp(-Seconds(candidate.approach.time_ns, begin_ns) / options.visit_fades_s);
      candidate.weight *= 1.0 + (options.visited_factor - 1.0) * fading;
    }
    candidates.push_back(candidate);
  }
  return BestOf(candidates, options);
}

// What the thing became: of the objects that appeared, the one that the person came by.
Candidate TargetOf(const Carry& carry, const AgentPath& holder, const Node& origin,
                   const std::vector<Node>& objects, const HeldOptions& options) {
  const TimeNs end_ns = carry.way.back().time_ns;
  std::vector<Candidate> candidates;
  for (const Node& object : objects) {
    if (object.class_id != carry.class_id || object.id == origin.id) continue;
    if (FirstSeen(object) < end_ns) continue;
    Candidate candidate{&object, options.visited_factor,
                        NearestApproach(holder, object, end_ns, FirstSeen(object))};
    if (candidate.approach.distance_m <= options.visit_m) candidates.push_back(candidate);
  }
  return BestOf(candidates, options);
}

bool Holds(const std::vector<Edge>& edges, const Edge& edge) {
  return std::any_of(edges.begin(), edges.end(),
                     [&](const Edge& other) { return other.key() == edge.key(); });
}

}  // namespace

std::vector<BoundOption> HeldOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<HeldOptions>(kHeldFields, this, &bound);
  return bound;
}

std::vector<Edge> FindHeldEdges(const std::vector<AgentPath>& people,
                                const std::vector<Carry>& carries, const std::vector<Node>& objects,
                                const HeldOptions& options) {
  std::vector<Edge> edges;
  for (const Carry& carry : carries) {
    const int person = HolderOf(people, carry, options);
    if (person < 0) continue;
    const AgentPath& holder = people[static_cast<size_t>(person)];
    const Candidate origin = OriginOf(carry, holder, objects, options);
    if (origin.object == nullptr) continue;
    Edge held{origin.object->id, relations::kHeldBy, holder.agent, origin.weight};
    const bool has_visit = origin.approach.distance_m <= options.visit_m;
    held.valid = {has_visit ? origin.approach.time_ns : carry.way.front().time_ns,
                  carry.way.back().time_ns + 1};
    held.attributes["seen_count"] = static_cast<double>(carry.way.size());
    if (!Holds(edges, held)) edges.push_back(held);
    const Candidate target = TargetOf(carry, holder, *origin.object, objects, options);
    if (target.object == nullptr) continue;
    Edge same{target.object->id, relations::kSameAs, origin.object->id,
              origin.weight * target.weight};
    if (same.weight > options.probability_min && !Holds(edges, same)) edges.push_back(same);
  }
  return edges;
}

}  // namespace dsg::ingest
