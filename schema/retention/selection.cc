// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/selection.h"

#include <algorithm>
#include <deque>
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

// Removed rooms take their mesh along; a region is a space itself.
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

class NodeChooser {
 public:
  NodeChooser(const Snapshot& map, const GraphIndex& index, const PrunePolicy& policy)
      : map_(map), index_(index), policy_(policy), is_gone_(index.nodes().size(), false) {}

  absl::Status Choose(const PrunePolicy::Branch& what) {
    DSG_ASSIGN_OR_RETURN(const NodeId root, map_.ResolveNode(what.id_or_name));
    const int64_t at = index_.Find(root);
    if (at >= 0) TakeBranch(static_cast<uint32_t>(at));
    return absl::OkStatus();
  }

  absl::Status Choose(const PrunePolicy::Region& what) {
    return TakeIf([&](const IndexedNode& node) {
      // Positions of agents are in their tracks.
      return !node.is_agent && what.box_map.contains(node.position_map);
    });
  }

  absl::Status Choose(const PrunePolicy::WholeLayer& what) {
    DSG_ASSIGN_OR_RETURN(const Layer layer, map_.FindLayer(what.name));
    return TakeIf([&](const IndexedNode& node) { return node.layer == layer.id; });
  }

  absl::Status Choose(const PrunePolicy::Before&) { return TakeEnded(); }
  absl::Status Choose(const PrunePolicy::OlderThan&) { return TakeEnded(); }
  absl::Status Choose(const PrunePolicy::UnseenSince&) { return TakeUnseen(); }
  absl::Status Choose(const PrunePolicy::UnseenFor&) { return TakeUnseen(); }

  // No selection, or history.
  template <class Other>
  absl::Status Choose(const Other&) {
    return absl::OkStatus();
  }

  const std::vector<bool>& is_gone() const { return is_gone_; }

 private:
  template <class Predicate>
  absl::Status TakeIf(const Predicate& goes) {
    for (size_t i = 0; i < is_gone_.size(); ++i) is_gone_[i] = goes(index_.nodes()[i]);
    return absl::OkStatus();
  }

  // A node that also has a parent outside the branch stays.
  void TakeBranch(uint32_t root) {
    std::vector<uint32_t> gone_parent_count(is_gone_.size(), 0);
    std::deque<uint32_t> open = {root};
    is_gone_[root] = true;
    while (!open.empty()) {
      const uint32_t parent = open.front();
      open.pop_front();
      for (const uint32_t child : index_.children(parent)) {
        const bool is_last = ++gone_parent_count[child] == index_.parents(child).size();
        if (!is_last || is_gone_[child] || index_.nodes()[child].is_agent) continue;
        is_gone_[child] = true;
        open.push_back(child);
      }
    }
  }

  const TrackInfo* TrackOf(NodeId agent) const {
    const auto& tracks = index_.tracks();
    const auto at =
        std::lower_bound(tracks.begin(), tracks.end(), agent,
                         [](const TrackInfo& track, NodeId id) { return track.agent < id; });
    return at == tracks.end() || at->agent != agent || at->pose_count == 0 ? nullptr : &*at;
  }

  // When a node was last seen; agents by their tracks too.
  std::optional<TimeNs> LastSeen(const IndexedNode& node) const {
    const TrackInfo* const track = node.is_agent ? TrackOf(node.id) : nullptr;
    if (track == nullptr) return node.last_observed_ns;
    return std::max(node.last_observed_ns.value_or(track->last_ns), track->last_ns);
  }

  std::optional<TimeNs> CutoffFor(const IndexedNode& node) const {
    return node.is_agent ? CutoffOf(policy_, index_.clock(), node.id)
                         : CutoffOf(policy_, index_.clock());
  }

  absl::Status TakeEnded() {
    if (!CutoffOf(policy_, index_.clock()).has_value()) return absl::OkStatus();
    return TakeIf([&](const IndexedNode& node) {
      const auto cutoff = CutoffFor(node);
      if (node.valid_to_ns <= *cutoff) return true;
      // An agent that loses all its poses goes too.
      const auto seen = node.is_agent ? LastSeen(node) : std::nullopt;
      return seen.has_value() && *seen < *cutoff;
    });
  }

  // A node counts as seen when one of its descendants is. A node without a time of its own that
  // contains nodes without times has no time; it goes only with all its parents.
  absl::Status TakeUnseen() {
    if (!CutoffOf(policy_, index_.clock()).has_value()) return absl::OkStatus();
    std::vector<std::optional<TimeNs>> seen(is_gone_.size());
    std::vector<bool> holds_undated(is_gone_.size(), false);
    std::vector<bool> is_dated(is_gone_.size(), false);
    for (const uint32_t at : index_.bottom_up()) {
      const auto own = LastSeen(index_.nodes()[at]);
      if (own.has_value()) seen[at] = std::max(seen[at].value_or(*own), *own);
      is_dated[at] = own.has_value() || (seen[at].has_value() && !holds_undated[at]);
      for (const uint32_t parent : index_.parents(at)) {
        if (!is_dated[at]) holds_undated[parent] = true;
        if (seen[at].has_value()) {
          seen[parent] = std::max(seen[parent].value_or(*seen[at]), *seen[at]);
        }
      }
    }
    const auto& order = index_.bottom_up();
    for (auto it = order.rbegin(); it != order.rend(); ++it) {
      const auto& parents = index_.parents(*it);
      const auto is_gone = [this](uint32_t parent) { return is_gone_[parent]; };
      is_gone_[*it] =
          is_dated[*it] ? *seen[*it] < *CutoffFor(index_.nodes()[*it])
                        : !parents.empty() && std::all_of(parents.begin(), parents.end(), is_gone);
    }
    return absl::OkStatus();
  }

  const Snapshot& map_;
  const GraphIndex& index_;
  const PrunePolicy& policy_;
  std::vector<bool> is_gone_;
};

absl::Status ChooseNodes(const Snapshot& map, const GraphIndex& index, const PrunePolicy& policy,
                         const LayerSet& layers, Selection* selection) {
  NodeChooser chooser(map, index, policy);
  DSG_RETURN_IF_ERROR(
      std::visit([&](const auto& what) { return chooser.Choose(what); }, policy.what));
  selection->is_gone = chooser.is_gone();
  for (size_t i = 0; i < selection->is_gone.size(); ++i) {
    if (!layers.Holds(index.nodes()[i].layer)) selection->is_gone[i] = false;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::map<NodeId, std::vector<Interval>>> SpansInBox(const Snapshot& map,
                                                                   const Box3d& box,
                                                                   const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                       map.VisitsToBox(box, kTimeMin, kTimeMax, stop));
  std::map<NodeId, std::vector<Interval>> spans;
  for (const BoxVisit& visit : visits) {
    spans[visit.agent].push_back({visit.enter_ns, visit.exit_ns});
  }
  return spans;
}

// The spans of tracks that the policy names.
absl::StatusOr<std::map<NodeId, std::vector<Interval>>> SpansOf(const Snapshot& map,
                                                                const GraphIndex& index,
                                                                const PrunePolicy& policy,
                                                                const StopCheck& stop) {
  if (const auto* region = std::get_if<PrunePolicy::Region>(&policy.what)) {
    return SpansInBox(map, region->box_map, stop);
  }
  std::map<NodeId, std::vector<Interval>> spans;
  const bool is_time = std::holds_alternative<PrunePolicy::Before>(policy.what) ||
                       std::holds_alternative<PrunePolicy::OlderThan>(policy.what);
  if (!is_time && !policy.IsThinning()) return spans;
  for (const TrackInfo& track : index.tracks()) {
    Interval span;
    if (is_time) {
      const auto cutoff = CutoffOf(policy, index.clock(), track.agent);
      if (!cutoff.has_value()) return spans;
      span.to_ns = *cutoff;
    }
    spans[track.agent].push_back(span);
  }
  return spans;
}

absl::Status ChooseTracks(const Snapshot& map, const GraphIndex& index, const PrunePolicy& policy,
                          const StopCheck& stop, Selection* selection) {
  DSG_ASSIGN_OR_RETURN(const auto spans_of, SpansOf(map, index, policy, stop));
  const bool is_time = std::holds_alternative<PrunePolicy::Before>(policy.what) ||
                       std::holds_alternative<PrunePolicy::OlderThan>(policy.what);
  for (const auto& [agent, spans] : spans_of) {
    TrackChoice choice;
    choice.agent = agent;
    if (policy.IsThinning()) {
      for (const Interval& span : spans) {
        choice.thinnings.push_back(
            {span, /*ends_are_fixed=*/!is_time, policy.simplify_m, policy.simplify_rad});
      }
    } else {
      choice.forgotten = JoinIntervals(spans);
      if (is_time) choice.stays_until_ns = spans.front().to_ns;
    }
    selection->tracks.push_back(std::move(choice));
  }
  return absl::OkStatus();
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
