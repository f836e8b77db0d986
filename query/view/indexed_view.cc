// SPDX-License-Identifier: Apache-2.0
// The questions to a view; see view_loading.cc for how one is made.
#include "query/view/indexed_view.h"

#include <algorithm>
#include <unordered_set>

#include "schema/base/check.h"

namespace dsg::query {

size_t IndexedView::memory_bytes() const { return parts_.memory_bytes() + places_->memory_bytes(); }

void IndexedView::ForEachNode(NodeId after,
                              const std::function<bool(const ViewNode&)>& visit) const {
  parts_.nodes().Scan(after, [&](const ViewNode& node) { return node.id == after || visit(node); });
}

std::vector<NodeId> IndexedView::NodesNamed(std::string_view name) const {
  std::vector<NodeId> ids;
  const auto symbol = symbols().Find(name);
  if (!name.empty() && symbol.has_value()) AppendNodesNamed(*symbol, &ids);
  return ids;
}

std::vector<NodeId> IndexedView::NodesNamedIgnoringCase(std::string_view name) const {
  std::vector<NodeId> ids;
  if (name.empty()) return ids;
  for (const Symbol symbol : symbols().FindIgnoringCase(name)) AppendNodesNamed(symbol, &ids);
  std::sort(ids.begin(), ids.end());
  return ids;
}

void IndexedView::AppendNodesNamed(Symbol name, std::vector<NodeId>* ids) const {
  parts_.names().Scan({name, NodeId()}, [&](const std::pair<Symbol, NodeId>& entry) {
    if (entry.first != name) return false;
    ids->push_back(entry.second);
    return true;
  });
}

void IndexedView::ForEachInRange(const SpaceRange& range,
                                 const std::function<bool(const ViewNode&)>& visit) const {
  parts_.space().Scan(range.first, [&](const SpaceEntry& entry) {
    return entry.key <= range.second && visit(*FindNode(entry.key.id));
  });
}

void IndexedView::ForEachOfClass(LayerId layer, Symbol class_name,
                                 const std::function<bool(const ViewNode&)>& visit) const {
  ForEachInRange(RangeOf(layer, class_name), visit);
}

void IndexedView::ForEachInLayer(LayerId layer,
                                 const std::function<bool(const ViewNode&)>& visit) const {
  ForEachInRange(RangeOf(layer), visit);
}

std::vector<std::pair<Symbol, int64_t>> IndexedView::ClassesOf(LayerId layer) const {
  std::vector<std::pair<Symbol, int64_t>> classes;
  const auto& counts = parts_.class_counts();
  for (auto it = counts.lower_bound({layer, 0}); it != counts.end() && it->first.first == layer;
       ++it) {
    classes.emplace_back(it->first.second, it->second);
  }
  return classes;
}

void IndexedView::ForEachEdgeFrom(NodeId source,
                                  const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachFrom(source, visit);
}

void IndexedView::ForEachEdgeFrom(NodeId source, Symbol relation,
                                  const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachFrom(source, relation, visit);
}

void IndexedView::ForEachEdgeTo(NodeId target,
                                const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachTo(target, visit);
}

void IndexedView::ForEachEdgeTo(NodeId target, Symbol relation,
                                const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachTo(target, relation, visit);
}

NodeId IndexedView::Parent(NodeId id) const {
  return parts_.edges().FirstSource(id, parts_.contains());
}

std::vector<NodeId> IndexedView::Ancestors(NodeId id) const {
  std::vector<NodeId> ancestors;
  // Ranks grow from child to parent, so the chain ends.
  for (NodeId at = Parent(id); !at.empty(); at = Parent(at)) ancestors.push_back(at);
  return ancestors;
}

void IndexedView::ForEachDescendant(NodeId id,
                                    const std::function<bool(const ViewNode&)>& visit) const {
  std::vector<NodeId> level = {id};
  // A node may have several parents, also at different heights.
  std::unordered_set<NodeId> seen = {id};
  while (!level.empty()) {
    std::vector<NodeId> children;
    for (const NodeId parent : level) {
      const size_t first = children.size();
      parts_.edges().AppendTargets(parent, parts_.contains(), &children);
      size_t kept = first;
      for (size_t i = first; i < children.size(); ++i) {
        if (!seen.insert(children[i]).second) continue;
        children[kept++] = children[i];
        if (!visit(*FindNode(children[i]))) return;
      }
      children.resize(kept);
    }
    level = std::move(children);
  }
}

std::vector<SpaceRange> IndexedView::RangesOf(const SpaceFilter& filter) const {
  std::vector<SpaceRange> ranges;
  if (!filter.layer.has_value() && !filter.class_name.has_value()) return {RangeOfAll()};
  if (!filter.class_name.has_value()) return {RangeOf(*filter.layer)};
  if (filter.layer.has_value()) return {RangeOf(*filter.layer, *filter.class_name)};
  for (const auto& [key, unused] : parts_.class_counts()) {
    if (key.second == *filter.class_name) ranges.push_back(RangeOf(key.first, key.second));
  }
  return ranges;
}

void IndexedView::ForEachNearest(
    const Eigen::Vector3d& point_map, const SpaceFilter& filter, double distance_m_max,
    const std::function<bool(const ViewNode&, double distance_m)>& visit) const {
  VisitNearest(
      parts_.space(), RangesOf(filter), point_map, distance_m_max,
      [this](NodeId id) { return FindNode(id); }, visit);
}

void IndexedView::ForEachTouching(const Box3d& box_map, const SpaceFilter& filter,
                                  const std::function<bool(const ViewNode&)>& visit) const {
  VisitCandidates(parts_.space(), RangesOf(filter), box_map, [&](NodeId id) {
    const ViewNode* node = FindNode(id);
    return !node->BoxMap().intersects(box_map) || visit(*node);
  });
}

absl::StatusOr<std::shared_ptr<const PlaceGraph>> IndexedView::Places(const StopCheck& stop) const {
  return places_->graph.Get(stop, [&] { return PlaceGraph::Build(*this, stop); });
}

}  // namespace dsg::query
