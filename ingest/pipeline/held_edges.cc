// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/held_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace dsg::ingest {
namespace {

constexpr double kHandM = 1.0;
// Of the points of a carry that are beside the person.
constexpr double kBesideMin = 0.6;
constexpr double kVisitM = 1.2;
constexpr TimeNs kTorsoGapNs = 2 * kNsPerSecond;
// How much likelier a thing is the one when it was found missing, and when the person came by just
// before; and how likely it is that the map never held the thing.
constexpr double kMissedFactor = 3.0;
constexpr double kVisitedFactor = 6.0;
constexpr double kVisitFadesS = 30.0;
constexpr double kUnknownWeight = 0.2;
// Things are mostly taken from near by; metres.
constexpr double kNearM = 8.0;
constexpr double kWalkMps = 1.5;
constexpr double kProbabilityMin = 0.6;

double AlongFloor(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).head<2>().norm();
}

// Where a torso was; nullopt while it was not seen.
std::optional<Eigen::Vector3d> TorsoAt(const AgentPath& path, TimeNs time_ns) {
  const auto after = std::lower_bound(
      path.torso.begin(), path.torso.end(), time_ns,
      [](const TimedPoint& point, TimeNs wanted_ns) { return point.time_ns < wanted_ns; });
  if (after == path.torso.end()) return std::nullopt;
  if (after->time_ns == time_ns) return after->position_map;
  if (after == path.torso.begin()) return std::nullopt;
  const TimedPoint& before = *std::prev(after);
  const TimeNs gap_ns = after->time_ns - before.time_ns;
  if (gap_ns > kTorsoGapNs) return std::nullopt;
  const double share = static_cast<double>(time_ns - before.time_ns) / static_cast<double>(gap_ns);
  return before.position_map + share * (after->position_map - before.position_map);
}

// Index of the person beside whom a thing went, -1 = nobody.
int HolderOf(const std::vector<AgentPath>& people, const Carry& carry) {
  int holder = -1;
  double least_m = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < people.size(); ++i) {
    double sum_m = 0.0;
    int beside_count = 0;
    for (const Carry::Point& point : carry.way) {
      const auto torso_map = TorsoAt(people[i], point.time_ns);
      if (!torso_map.has_value()) continue;
      const double distance_m = AlongFloor(*torso_map, point.position_map);
      if (distance_m > kHandM) continue;
      sum_m += distance_m;
      ++beside_count;
    }
    if (beside_count < kBesideMin * static_cast<double>(carry.way.size())) continue;
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
Candidate BestOf(const std::vector<Candidate>& candidates) {
  Candidate best;
  double sum = kUnknownWeight;
  for (const Candidate& candidate : candidates) {
    sum += candidate.weight;
    if (candidate.weight > best.weight) best = candidate;
  }
  if (best.object == nullptr || best.weight <= kProbabilityMin * sum) return {};
  best.weight /= sum;
  return best;
}

TimeNs FirstSeen(const Node& object) {
  return object.first_observed_ns.value_or(object.valid.from_ns);
}

// What the thing was before.
Candidate OriginOf(const Carry& carry, const AgentPath& holder, const std::vector<Node>& objects) {
  const TimeNs begin_ns = carry.way.front().time_ns;
  std::vector<Candidate> candidates;
  for (const Node& object : objects) {
    const TimeNs last_ns = object.last_observed_ns.value_or(object.valid.from_ns);
    if (object.class_id != carry.class_id || FirstSeen(object) >= begin_ns || last_ns >= begin_ns) {
      continue;
    }
    const double way_m = AlongFloor(object.map_T_node.position, carry.way.front().position_map);
    if (way_m > kVisitM + kWalkMps * Seconds(last_ns, begin_ns)) continue;
    Candidate candidate{&object, std::exp(-way_m / kNearM), {}};
    // Who came when it was missing already did not take it.
    const TimeNs until_ns = std::min(begin_ns, object.valid.to_ns);
    candidate.approach = NearestApproach(holder, object, last_ns, until_ns);
    if (object.valid.to_ns != kTimeMax) candidate.weight *= kMissedFactor;
    if (candidate.approach.distance_m <= kVisitM) {
      const double fading = std::exp(-Seconds(candidate.approach.time_ns, begin_ns) / kVisitFadesS);
      candidate.weight *= 1.0 + (kVisitedFactor - 1.0) * fading;
    }
    candidates.push_back(candidate);
  }
  return BestOf(candidates);
}

// What the thing became: of the objects that appeared, the one that the person came by.
Candidate TargetOf(const Carry& carry, const AgentPath& holder, const Node& origin,
                   const std::vector<Node>& objects) {
  const TimeNs end_ns = carry.way.back().time_ns;
  std::vector<Candidate> candidates;
  for (const Node& object : objects) {
    if (object.class_id != carry.class_id || object.id == origin.id) continue;
    if (FirstSeen(object) < end_ns) continue;
    Candidate candidate{&object, kVisitedFactor,
                        NearestApproach(holder, object, end_ns, FirstSeen(object))};
    if (candidate.approach.distance_m <= kVisitM) candidates.push_back(candidate);
  }
  return BestOf(candidates);
}

bool Holds(const std::vector<Edge>& edges, const Edge& edge) {
  return std::any_of(edges.begin(), edges.end(),
                     [&](const Edge& other) { return other.key() == edge.key(); });
}

}  // namespace

std::vector<Edge> FindHeldEdges(const std::vector<AgentPath>& people,
                                const std::vector<Carry>& carries,
                                const std::vector<Node>& objects) {
  std::vector<Edge> edges;
  for (const Carry& carry : carries) {
    const int person = HolderOf(people, carry);
    if (person < 0) continue;
    const AgentPath& holder = people[static_cast<size_t>(person)];
    const Candidate origin = OriginOf(carry, holder, objects);
    if (origin.object == nullptr) continue;
    Edge held{origin.object->id, relations::kHeldBy, holder.agent, origin.weight};
    const bool has_visit = origin.approach.distance_m <= kVisitM;
    held.valid = {has_visit ? origin.approach.time_ns : carry.way.front().time_ns,
                  carry.way.back().time_ns + 1};
    held.attributes["seen_count"] = static_cast<double>(carry.way.size());
    if (!Holds(edges, held)) edges.push_back(held);
    const Candidate target = TargetOf(carry, holder, *origin.object, objects);
    if (target.object == nullptr) continue;
    Edge same{target.object->id, relations::kSameAs, origin.object->id,
              origin.weight * target.weight};
    if (same.weight > kProbabilityMin && !Holds(edges, same)) edges.push_back(same);
  }
  return edges;
}

}  // namespace dsg::ingest
