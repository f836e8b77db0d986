// SPDX-License-Identifier: Apache-2.0
// Whether nodes are what a pattern says, for many nodes of one view.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "query/engine/search/pattern.h"
#include "query/view/graph_view.h"

namespace dsg::query {

/// Remembers what it found of nodes at the other ends of relations, up to a bound, so that asking
/// for every node of a map costs no more than walking each hierarchy once.
///
/// Threads: one caller at a time.
class Matcher {
 public:
  /// `view` must outlive this; nullopt = at any time, each condition for itself.
  Matcher(const GraphView& view, std::optional<TimeNs> at_ns, StopCheck stop)
      : view_(view), at_ns_(at_ns), stop_(std::move(stop)) {}

  bool Matches(const CompiledPattern& pattern, const ViewNode& node);

  /// One node for each relation of the pattern, in its order; empty where negated. Of several the
  /// one with the lowest id; of those above or below in the hierarchy, of the nearest.
  /// Requires: the node matches.
  std::vector<NodeId> Related(const CompiledPattern& pattern, const ViewNode& node);

  /// Every node that an edge, or the hierarchy, leads to from here when the relation is walked
  /// against its sense: all that may have this relation to `node`. Until `visit` returns false.
  void ForEachThatMayRelateTo(const CompiledRelation& relation, std::optional<Symbol> contains,
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
  NodeId FindRelated(const CompiledRelation& relation, std::optional<Symbol> contains,
                     const ViewNode& node);
  /// Nodes at the other ends of edges of one symbol, ascending id in each direction.
  void ForEachAcross(Symbol symbol, bool outgoing, NodeId node, const Visit& visit);
  /// Breadth first over CONTAINS.
  void ForEachInHierarchy(Symbol contains, bool up, NodeId node, const Visit& visit);

  const GraphView& view_;
  std::optional<TimeNs> at_ns_;
  StopCheck stop_;
  absl::Status status_;
  uint64_t work_count_ = 0;
  // By index of the pattern; only patterns with relations, which are dear.
  std::vector<std::unordered_map<NodeId, bool>> known_;
  size_t known_count_ = 0;
};

}  // namespace dsg::query
