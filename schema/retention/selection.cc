// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/selection.h"

#include <algorithm>
#include <map>

#include "schema/base/status.h"

namespace dsg {
namespace {

void AddTracks(const std::vector<TrackChoice>& from, std::vector<TrackChoice>* to) {
  std::map<NodeId, TrackChoice> by_agent;
  for (TrackChoice& choice : *to) by_agent[choice.agent] = std::move(choice);
  for (const TrackChoice& choice : from) {
    TrackChoice& into = by_agent[choice.agent];
    into.agent = choice.agent;
    into.forgotten.insert(into.forgotten.end(), choice.forgotten.begin(), choice.forgotten.end());
    into.forgotten = JoinIntervals(std::move(into.forgotten));
    into.stays_until_ns = std::max(into.stays_until_ns, choice.stays_until_ns);
    into.thinnings.insert(into.thinnings.end(), choice.thinnings.begin(), choice.thinnings.end());
  }
  to->clear();
  for (auto& [agent, choice] : by_agent) to->push_back(std::move(choice));
}

TimeNs Back(TimeNs from_ns, TimeNs age_ns) {
  return from_ns < kTimeMin + age_ns ? kTimeMin : from_ns - age_ns;
}

std::optional<TimeNs> CutoffBefore(const PrunePolicy& policy, std::optional<TimeNs> now_ns) {
  const auto back = [&](TimeNs age_ns) {
    return now_ns.has_value() ? std::optional<TimeNs>(Back(*now_ns, age_ns)) : std::nullopt;
  };
  const auto& what = policy.what;
  if (const auto* before = std::get_if<PrunePolicy::Before>(&what)) return before->at_ns;
  if (const auto* unseen = std::get_if<PrunePolicy::UnseenSince>(&what)) return unseen->at_ns;
  if (const auto* older = std::get_if<PrunePolicy::OlderThan>(&what)) return back(older->age_ns);
  if (const auto* unseen = std::get_if<PrunePolicy::UnseenFor>(&what)) return back(unseen->age_ns);
  return std::nullopt;
}

bool IsMeshWanted(const PrunePolicy& policy) {
  return policy.layers.empty() ||
         std::find(policy.layers.begin(), policy.layers.end(), "mesh") != policy.layers.end();
}

// Rooms that go take the mesh in them along; a region is a space itself.
void ChooseMesh(const GraphIndex& index, const PrunePolicy& policy, Selection* selection) {
  if (!IsMeshWanted(policy) || policy.IsThinning()) return;
  if (const auto* layer = std::get_if<PrunePolicy::WholeLayer>(&policy.what)) {
    selection->all_mesh = layer->name == "mesh";
  }
  if (const auto* region = std::get_if<PrunePolicy::Region>(&policy.what)) {
    selection->solids.push_back({region->box_map, {}});
  }
  if (!std::holds_alternative<PrunePolicy::Branch>(policy.what)) return;
  for (size_t i = 0; i < selection->is_gone.size(); ++i) {
    const int32_t solid = index.nodes()[i].solid;
    if (selection->is_gone[i] && solid >= 0) {
      selection->solids.push_back(index.solids()[static_cast<size_t>(solid)]);
    }
  }
}

}  // namespace

std::vector<Interval> JoinIntervals(std::vector<Interval> intervals) {
  std::sort(intervals.begin(), intervals.end(),
            [](const Interval& a, const Interval& b) { return a.from_ns < b.from_ns; });
  std::vector<Interval> joined;
  for (const Interval& interval : intervals) {
    if (!joined.empty() && interval.from_ns <= joined.back().to_ns) {
      joined.back().to_ns = std::max(joined.back().to_ns, interval.to_ns);
    } else {
      joined.push_back(interval);
    }
  }
  return joined;
}

void Selection::Add(const Selection& other) {
  if (is_gone.size() < other.is_gone.size()) is_gone.resize(other.is_gone.size(), false);
  for (size_t i = 0; i < other.is_gone.size(); ++i) {
    if (other.is_gone[i]) is_gone[i] = true;
  }
  all_mesh |= other.all_mesh;
  solids.insert(solids.end(), other.solids.begin(), other.solids.end());
  AddTracks(other.tracks, &tracks);
}

std::optional<TimeNs> CutoffOf(const PrunePolicy& policy, const WorldClock& clock) {
  return CutoffBefore(policy, clock.now_ns);
}

std::optional<TimeNs> CutoffOf(const PrunePolicy& policy, const WorldClock& clock, NodeId agent) {
  if (!clock.now_ns.has_value()) return CutoffBefore(policy, std::nullopt);
  return CutoffBefore(policy, clock.NowOf(agent));
}

absl::StatusOr<LayerSet> LayerSet::Of(const PrunePolicy& policy, const Snapshot& map) {
  LayerSet set;
  set.is_all_ = policy.layers.empty();
  for (const std::string& name : policy.layers) {
    DSG_ASSIGN_OR_RETURN(const Layer layer, map.FindLayer(name));
    set.layers_.push_back(layer.id);
  }
  return set;
}

bool LayerSet::Holds(LayerId layer) const {
  return is_all_ || std::find(layers_.begin(), layers_.end(), layer) != layers_.end();
}

absl::StatusOr<Selection> Select(const Snapshot& map, const GraphIndex& index,
                                 const PrunePolicy& policy, const StopCheck& stop) {
  Selection selection;
  selection.is_gone.assign(index.nodes().size(), false);
  if (policy.IsHistory()) return selection;
  DSG_ASSIGN_OR_RETURN(const LayerSet layers, LayerSet::Of(policy, map));
  if (!policy.IsThinning()) {
    DSG_RETURN_IF_ERROR(ChooseNodes(map, index, policy, layers, &selection));
  }
  if (layers.Holds(layers::kAgents)) {
    DSG_RETURN_IF_ERROR(ChooseTracks(map, index, policy, stop, &selection));
  }
  ChooseMesh(index, policy, &selection);
  return selection;
}

}  // namespace dsg
