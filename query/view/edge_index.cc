// SPDX-License-Identifier: Apache-2.0
#include "query/view/edge_index.h"

#include <algorithm>

#include "query/view/stoppable_sort.h"
#include "schema/base/check.h"

namespace dsg::query {
namespace {

bool IsAlwaysValid(const Interval& valid) { return valid == Interval(); }

// Sorts, drops what stands twice, and makes a tree of the rest.
template <typename Traits>
absl::StatusOr<CowTree<Traits>> MakeTree(std::vector<typename Traits::Entry> entries,
                                         const StopCheck& stop) {
  using Entry = typename Traits::Entry;
  const auto less = [](const Entry& a, const Entry& b) {
    return Traits::KeyOf(a) < Traits::KeyOf(b);
  };
  DSG_RETURN_IF_ERROR(SortStoppably(less, stop, &entries));
  StopCounter counter(stop);
  typename CowTree<Traits>::Builder builder;
  for (size_t i = 0; i < entries.size(); ++i) {
    DSG_RETURN_IF_ERROR(counter.Check());
    if (i > 0 && !less(entries[i - 1], entries[i])) continue;
    builder.Append(entries[i]);
  }
  return builder.Finish();
}

}  // namespace

absl::StatusOr<EdgeIndex> EdgeIndex::Make(std::vector<ViewEdge> edges, const StopCheck& stop) {
  EdgeIndex index;
  std::vector<Times> times;
  {
    std::vector<Forward> forward;
    forward.reserve(edges.size());
    for (const ViewEdge& edge : edges) {
      const bool always = IsAlwaysValid(edge.valid);
      forward.push_back({edge.source, edge.target, edge.relation, always ? 1U : 0U, edge.weight});
      if (!always) times.push_back({{edge.source, edge.relation, edge.target}, edge.valid});
    }
    DSG_ASSIGN_OR_RETURN(index.forward_, MakeTree<ForwardTraits>(std::move(forward), stop));
  }
  std::vector<Backward> backward;
  backward.reserve(edges.size());
  for (const ViewEdge& edge : edges) {
    const bool plain = edge.weight == 1.0 && IsAlwaysValid(edge.valid);
    backward.push_back({edge.target, edge.source, edge.relation, plain ? 1U : 0U});
  }
  DSG_ASSIGN_OR_RETURN(index.backward_, MakeTree<BackwardTraits>(std::move(backward), stop));
  DSG_ASSIGN_OR_RETURN(index.times_, MakeTree<TimesTraits>(std::move(times), stop));
  return index;
}

EdgeIndex EdgeIndex::Fork() const {
  EdgeIndex fork;
  fork.forward_ = forward_.Fork();
  fork.backward_ = backward_.Fork();
  fork.times_ = times_.Fork();
  return fork;
}

void EdgeIndex::Put(const ViewEdge& edge) {
  const bool always = IsAlwaysValid(edge.valid);
  const Key key{edge.source, edge.relation, edge.target};
  forward_.Put({edge.source, edge.target, edge.relation, always ? 1U : 0U, edge.weight});
  backward_.Put({edge.target, edge.source, edge.relation, always && edge.weight == 1.0 ? 1U : 0U});
  if (always) {
    times_.Erase(key);
  } else {
    times_.Put({key, edge.valid});
  }
}

bool EdgeIndex::Erase(NodeId source, Symbol relation, NodeId target) {
  if (!forward_.Erase({source, relation, target})) return false;
  backward_.Erase({target, relation, source});
  times_.Erase({source, relation, target});
  return true;
}

ViewEdge EdgeIndex::ToView(const Forward& edge) const {
  ViewEdge shown{edge.source, edge.target, edge.relation, edge.weight, Interval()};
  if (edge.is_always_valid == 0) {
    shown.valid = times_.Find({edge.source, edge.relation, edge.target})->valid;
  }
  return shown;
}

ViewEdge EdgeIndex::ToView(const Backward& edge) const {
  if (edge.is_plain != 0) {
    return {edge.source, edge.target, edge.relation, 1.0, Interval()};
  }
  const Forward* forward = forward_.Find({edge.source, edge.relation, edge.target});
  DSG_CHECK(forward != nullptr);
  return ToView(*forward);
}

void EdgeIndex::ForEachFrom(NodeId source,
                            const std::function<bool(const ViewEdge&)>& visit) const {
  forward_.Scan({source, 0, NodeId()},
                [&](const Forward& edge) { return edge.source == source && visit(ToView(edge)); });
}

void EdgeIndex::ForEachFrom(NodeId source, Symbol relation,
                            const std::function<bool(const ViewEdge&)>& visit) const {
  forward_.Scan({source, relation, NodeId()}, [&](const Forward& edge) {
    return edge.source == source && edge.relation == relation && visit(ToView(edge));
  });
}

void EdgeIndex::ForEachTo(NodeId target, const std::function<bool(const ViewEdge&)>& visit) const {
  backward_.Scan({target, 0, NodeId()}, [&](const Backward& edge) {
    return edge.target == target && visit(ToView(edge));
  });
}

void EdgeIndex::ForEachTo(NodeId target, Symbol relation,
                          const std::function<bool(const ViewEdge&)>& visit) const {
  backward_.Scan({target, relation, NodeId()}, [&](const Backward& edge) {
    return edge.target == target && edge.relation == relation && visit(ToView(edge));
  });
}

NodeId EdgeIndex::FirstSource(NodeId target, Symbol relation) const {
  NodeId source;
  backward_.Scan({target, relation, NodeId()}, [&](const Backward& edge) {
    if (edge.target == target && edge.relation == relation) source = edge.source;
    return false;
  });
  return source;
}

void EdgeIndex::AppendTargets(NodeId source, Symbol relation, std::vector<NodeId>* targets) const {
  forward_.Scan({source, relation, NodeId()}, [&](const Forward& edge) {
    if (edge.source != source || edge.relation != relation) return false;
    targets->push_back(edge.target);
    return true;
  });
}

size_t EdgeIndex::memory_bytes() const {
  return forward_.memory_bytes() + backward_.memory_bytes() + times_.memory_bytes();
}

size_t EdgeIndex::fresh_bytes() const {
  return forward_.fresh_bytes() + backward_.fresh_bytes() + times_.fresh_bytes();
}

}  // namespace dsg::query
