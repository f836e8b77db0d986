// SPDX-License-Identifier: Apache-2.0
// The edges of a view, found from both of their ends, without attributes.
#pragma once

#include <functional>
#include <vector>

#include "query/view/cow_tree.h"
#include "query/view/graph_view.h"

namespace dsg::query {

/// Threads: as CowTree.
class EdgeIndex {
 public:
  /// Edges in any order; of several with the same ends and relation any is kept.
  /// Errors: what `stop` returned.
  static absl::StatusOr<EdgeIndex> Make(std::vector<ViewEdge> edges, const StopCheck& stop);

  EdgeIndex Fork() const;
  void Put(const ViewEdge& edge);
  /// False if there is none.
  bool Erase(NodeId source, Symbol relation, NodeId target);

  /// Order: ascending relation, target. Until `visit` returns false.
  void ForEachFrom(NodeId source, const std::function<bool(const ViewEdge&)>& visit) const;
  void ForEachFrom(NodeId source, Symbol relation,
                   const std::function<bool(const ViewEdge&)>& visit) const;
  /// Order: ascending relation, source.
  void ForEachTo(NodeId target, const std::function<bool(const ViewEdge&)>& visit) const;
  void ForEachTo(NodeId target, Symbol relation,
                 const std::function<bool(const ViewEdge&)>& visit) const;
  /// The source of the first edge to a node; empty if there is none.
  NodeId FirstSource(NodeId target, Symbol relation) const;
  /// Targets of one relation, ascending, appended.
  void AppendTargets(NodeId source, Symbol relation, std::vector<NodeId>* targets) const;

  int64_t size() const { return static_cast<int64_t>(forward_.size()); }
  size_t memory_bytes() const;
  size_t fresh_bytes() const;

 private:
  // (near end, relation, far end), whichever way the tree looks.
  struct Key {
    NodeId near;
    Symbol relation = 0;
    NodeId far;
    auto operator<=>(const Key&) const = default;
  };
  struct Forward {
    NodeId source;
    NodeId target;
    Symbol relation = 0;
    // Else its validity stands in `times_`.
    uint32_t is_always_valid = 1;
    double weight = 1.0;
  };
  struct Backward {
    NodeId target;
    NodeId source;
    Symbol relation = 0;
    // Weight 1 and always valid, as the hierarchy's edges are; else `forward_` knows.
    uint32_t is_plain = 1;
  };
  struct Times {
    Key key;
    Interval valid;
  };
  struct ForwardTraits {
    using Entry = Forward;
    using Key = EdgeIndex::Key;
    using Summary = NoSummary;
    static constexpr int kLeafEntries = 64;
    static constexpr int kChildren = 64;
    static Key KeyOf(const Forward& edge) { return {edge.source, edge.relation, edge.target}; }
  };
  struct BackwardTraits {
    using Entry = Backward;
    using Key = EdgeIndex::Key;
    using Summary = NoSummary;
    static constexpr int kLeafEntries = 64;
    static constexpr int kChildren = 64;
    static Key KeyOf(const Backward& edge) { return {edge.target, edge.relation, edge.source}; }
  };
  struct TimesTraits {
    using Entry = Times;
    using Key = EdgeIndex::Key;
    using Summary = NoSummary;
    static constexpr int kLeafEntries = 32;
    static constexpr int kChildren = 64;
    static Key KeyOf(const Times& times) { return times.key; }
  };

  ViewEdge ToView(const Forward& edge) const;
  ViewEdge ToView(const Backward& edge) const;

  CowTree<ForwardTraits> forward_;
  CowTree<BackwardTraits> backward_;
  CowTree<TimesTraits> times_;
};

}  // namespace dsg::query
