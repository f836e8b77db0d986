// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/held.h"

#include <algorithm>
#include <map>
#include <optional>

#include "query/engine/interaction/track_path.h"
#include "schema/model/edge.h"

namespace dsg::query {
namespace {

// A way is seen in parts: it may be seen to begin after the thing was missed.
constexpr TimeNs kOnTheWayNs = 30 * kNsPerSecond;
// Looks at the spot and at the hand are of different pictures.
constexpr TimeNs kLookNs = 2 * kNsPerSecond;
// Less speaks against it more than for it.
constexpr double kProbabilityMin = 0.5;

bool IsOfChange(const ObjectChange& change, const Interval& held) {
  if (change.type == ChangeType::kPicked) {
    return held.from_ns >= AddTime(change.earliest_ns, -kLookNs) &&
           held.from_ns <= AddTime(change.latest_ns, kOnTheWayNs);
  }
  return held.to_ns >= AddTime(change.earliest_ns, -kOnTheWayNs) &&
         held.to_ns <= AddTime(change.latest_ns, kLookNs);
}

}  // namespace

std::vector<Hold> FindHolds(const GraphView& view, const ObjectChange& change) {
  std::map<NodeId, Hold> holds;
  const std::optional<Symbol> held_by = view.symbols().Find(relations::kHeldBy);
  if (!held_by.has_value()) return {};
  const auto add = [&](NodeId object, double same_probability) {
    view.ForEachEdgeFrom(object, *held_by, [&](const ViewEdge& edge) {
      // What says that it is the same thing counts what says that it was held.
      const double probability = std::min(edge.weight, same_probability);
      if (!(probability > kProbabilityMin) || !IsOfChange(change, edge.valid)) return true;
      Hold& best = holds[edge.target];
      if (probability > best.probability) best = {edge.target, object, probability, edge.valid};
      return true;
    });
  };
  add(change.object, 1.0);
  const std::optional<Symbol> same_as = view.symbols().Find(relations::kSameAs);
  if (same_as.has_value()) {
    view.ForEachEdgeFrom(change.object, *same_as, [&](const ViewEdge& edge) {
      add(edge.target, edge.weight);
      return true;
    });
  }
  std::vector<Hold> found;
  found.reserve(holds.size());
  for (const auto& [agent, hold] : holds) found.push_back(hold);
  return found;
}

}  // namespace dsg::query
