// SPDX-License-Identifier: Apache-2.0
// Which nodes a policy matches.
#include <algorithm>
#include <deque>

#include "schema/base/status.h"
#include "schema/retention/selection.h"

namespace dsg {
namespace {

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
      // Agents are where their tracks say.
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

  // Nothing, or history.
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

  // A node that something outside of the branch contains too stays.
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

  // When an agent was seen last, as far as is known.
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
      // Of somebody all of whose poses go nothing is left to ask for.
      const auto seen = node.is_agent ? LastSeen(node) : std::nullopt;
      return seen.has_value() && *seen < *cutoff;
    });
  }

  // A node is seen when something in it is. What was never looked for itself, and holds what was
  // not, has no time: it goes only with all that contains it.
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

}  // namespace

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

}  // namespace dsg
