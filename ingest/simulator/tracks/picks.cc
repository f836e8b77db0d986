// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/tracks/picks.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "ingest/simulator/world/world_graph.h"

namespace dsg::simulator {
namespace {

constexpr double kReachM = 0.8;
// What one hand carries away.
constexpr double kSizeMaxM = 0.4;
constexpr TimeNs kPauseNsMin = 3 * kNsPerSecond;
// A mapper passes by some seconds before and after.
constexpr TimeNs kLookNs = 3 * kNsPerSecond;
// Looks at a thing before it is gone; enough to believe that it was there.
constexpr int64_t kObservationCount = 40;

double DistanceM(const Rect& rect, const Point& point) { return rect.exteriorDistance(point); }

void AddPicksOf(const World& world, size_t agent, const Leg& leg, TimeNs until_ns,
                std::vector<Pick>* picks) {
  const TimeNs seen_ns = leg.begin_ns - kLookNs;
  const TimeNs missed_ns = leg.depart_ns + kLookNs;
  if (leg.depart_ns - leg.begin_ns < kPauseNsMin || seen_ns < 0 || missed_ns >= until_ns) return;
  const int room = world.plan.RoomAt(leg.start.position);
  for (size_t i = 0; i < world.furniture.size(); ++i) {
    const Furniture& item = world.furniture[i];
    if (item.on < 0 || item.room != room || item.size.maxCoeff() > kSizeMaxM) continue;
    if (DistanceM(item.Footprint(), leg.start.position) > kReachM) continue;
    picks->push_back({.agent = agent,
                      .object = i,
                      .at_ns = leg.begin_ns + (leg.depart_ns - leg.begin_ns) / 2,
                      .seen_ns = seen_ns,
                      .missed_ns = missed_ns});
  }
}

}  // namespace

std::vector<Pick> DrawPicks(const World& world, const Planner& planner,
                            const std::vector<AgentSpec>& crowd, uint64_t seed, TimeNs until_ns,
                            int count) {
  std::vector<Pick> possible;
  for (size_t i = 0; count > 0 && i < crowd.size(); ++i) {
    if (crowd[i].is_robot) continue;
    Walker walker(&world, &planner, crowd[i], seed);
    for (; walker.leg().begin_ns < until_ns; walker.NextLeg()) {
      AddPicksOf(world, i, walker.leg(), until_ns, &possible);
    }
  }
  std::sort(possible.begin(), possible.end(), [](const Pick& a, const Pick& b) {
    return std::tie(a.at_ns, a.agent, a.object) < std::tie(b.at_ns, b.agent, b.object);
  });
  // A thing is taken by the first who could, and nobody takes two things at once.
  std::set<size_t> taken;
  std::set<std::pair<size_t, TimeNs>> busy;
  std::vector<Pick> first;
  for (const Pick& pick : possible) {
    if (taken.contains(pick.object) || busy.contains({pick.agent, pick.at_ns})) continue;
    taken.insert(pick.object);
    busy.insert({pick.agent, pick.at_ns});
    first.push_back(pick);
  }
  std::vector<Pick> picks;
  const auto wanted = std::min(static_cast<size_t>(std::max(count, 0)), first.size());
  for (size_t i = 0; i < wanted; ++i) picks.push_back(first[i * first.size() / wanted]);
  return picks;
}

void ApplyPicks(const std::vector<Pick>& picks, GraphDelta* graph) {
  for (const Pick& pick : picks) {
    const NodeId id = ObjectId(static_cast<int>(pick.object));
    const auto node = std::find_if(graph->nodes.begin(), graph->nodes.end(),
                                   [&](const Node& other) { return other.id == id; });
    if (node == graph->nodes.end()) continue;
    node->valid.to_ns = pick.missed_ns;
    node->first_observed_ns = 0;
    node->last_observed_ns = pick.seen_ns;
    node->observation_count = kObservationCount;
  }
}

}  // namespace dsg::simulator
