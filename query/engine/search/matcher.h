// SPDX-License-Identifier: Apache-2.0
// Whether nodes are what a pattern says, for many nodes of one view.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "query/engine/search/pattern.h"
#include "query/engine/search/stays.h"
#include "query/view/graph_view.h"

namespace dsg::query {

/// Remembers what it found of nodes at the other ends of relations, up to a bound, so that asking
/// for every node of a map costs no more than walking each hierarchy once.
///
/// Threads: one caller at a time.
class Matcher {
 public:
  /// `view` must outlive this, and so must `snapshot`, which is as of Stays; nullopt = at any time,
  /// each condition for itself.
  Matcher(const GraphView& view, const Snapshot* snapshot, std::optional<TimeNs> at_ns,
          StopCheck stop)
      : view_(view), at_ns_(at_ns), stop_(std::move(stop)), stays_(view, snapshot, at_ns, stop_) {}
  // What it knows of stays refers to it.
  Matcher(const Matcher&) = delete;
  Matcher& operator=(const Matcher&) = delete;

  bool Matches(const CompiledPattern& pattern, const ViewNode& node);

  /// One node for each relation of the pattern, in its order; empty where negated. Of several the
  /// one with the lowest id; of those above or below in the hierarchy, of the nearest.
  /// Requires: the node matches.
  std::vector<NodeId> Related(const CompiledPattern& pattern, const ViewNode& node);

  /// Every node that an edge, the hierarchy or a stay leads to from here when the relation, one of
  /// `pattern`, is walked against its sense: all that may match the pattern by `node`. Until
  /// `visit` returns false.
  void ForEachThatMayRelateTo(const CompiledRelation& relation, const CompiledPattern& pattern,
                              const ViewNode& node,
                              const std::function<bool(const ViewNode&)>& visit);

  /// What `stop` returned. Once it is not OK, answers mean nothing and come at once.
  const absl::Status& status() const { return status_; }
  /// Counts work; false once it must stop.
  bool Tick();

 private:
  using Visit = std::function<bool(const ViewNode&)>;

  bool HoldsNow(const Interval& valid) const {
    return !at_ns_.has_value() || valid.Contains(*at_ns_);
  }
  bool MatchesAlone(const CompiledPattern& pattern, const ViewNode& node) const;
  bool MatchesRelations(const CompiledPattern& pattern, const ViewNode& node);
  bool MatchesAlternatives(const CompiledPattern& pattern, const ViewNode& node);
  NodeId FindRelated(const CompiledRelation& relation, const CompiledPattern& pattern,
                     const ViewNode& node);
  /// Nodes at the other ends of edges of one symbol, ascending id in each direction.
  void ForEachAcross(Symbol symbol, bool outgoing, NodeId node, const Visit& visit);
  /// Breadth first over CONTAINS. A stay leads up from its agent, and down to the agent but not to
  /// what is below it; `with_agents` false leaves the latter out.
  void ForEachInHierarchy(std::optional<Symbol> contains, bool up, bool with_agents,
                          const ViewNode& node, const Visit& visit);
  /// Where the agent stayed, nodes that hold then; none for what is no agent.
  std::vector<NodeId> StayedIn(const ViewNode& agent);
  std::vector<NodeId> AgentsIn(NodeId node);
  /// A result whose error stops everything.
  std::vector<NodeId> Then(absl::StatusOr<const std::vector<NodeId>*> ids);

  const GraphView& view_;
  std::optional<TimeNs> at_ns_;
  StopCheck stop_;
  absl::Status status_;
  Stays stays_;
  uint64_t work_count_ = 0;
  // By index of the pattern; only patterns with relations or alternatives, which are dear.
  std::vector<std::unordered_map<NodeId, bool>> known_;
  size_t known_count_ = 0;
};

}  // namespace dsg::query
