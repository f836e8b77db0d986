// SPDX-License-Identifier: Apache-2.0
#include "query/engine/view_filter.h"

#include <utility>

namespace dsg::query {

ViewFilter::ViewFilter(const NodeFilter& filter, const GraphView& graph)
    : filter_(filter), graph_(graph) {
  const auto find = [&](const std::string& text) {
    if (text.empty()) return std::optional<Symbol>();
    const std::optional<Symbol> symbol = graph.symbols().Find(text);
    can_match_ = can_match_ && symbol.has_value();
    return symbol;
  };
  kind_ = find(filter.kind);
  class_name_ = find(filter.class_name);
  name_ = find(filter.name);
}

bool ViewFilter::Matches(const ViewNode& node) const {
  return can_match_ && (!filter_.layer.has_value() || node.layer == *filter_.layer) &&
         (!kind_.has_value() || node.kind == *kind_) &&
         (!class_name_.has_value() || node.class_name == *class_name_) &&
         (!name_.has_value() || node.name == *name_) &&
         (!filter_.at_ns.has_value() || node.valid.Contains(*filter_.at_ns)) &&
         (!filter_.box_map.has_value() || node.BoxMap().intersects(*filter_.box_map)) &&
         (filter_.parent.empty() || IsChild(node.id));
}

bool ViewFilter::IsChild(NodeId node) const {
  const std::optional<Symbol> contains = graph_.symbols().Find(relations::kContains);
  bool is_child = false;
  if (!contains.has_value()) return false;
  graph_.ForEachEdgeTo(node, *contains, [&](const ViewEdge& edge) {
    is_child = edge.source == filter_.parent;
    return !is_child;
  });
  return is_child;
}

}  // namespace dsg::query
