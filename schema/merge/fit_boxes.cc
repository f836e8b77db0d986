// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/fit_boxes.h"

#include <algorithm>
#include <unordered_map>

#include "schema/model/delta_check.h"

namespace dsg::merge {
namespace {

struct Link {
  int32_t child_rank = 0;
  size_t parent = 0;
  size_t child = 0;
};

void GrowOver(const Node& child, Node* parent) {
  if (parent->box_node.isEmpty() || IsAgentKind(child.kind)) return;
  const Box3d inner = child.BoxMap();
  const Box3d outer = parent->BoxMap();
  // Half of what the store tolerates, so that old boxes stay to the bit.
  constexpr double kSlack = 0.5 * kBoxToleranceM;
  if (((outer.min() - inner.min()).array() <= kSlack).all() &&
      ((inner.max() - outer.max()).array() <= kSlack).all()) {
    return;
  }
  parent->box_node.extend(TransformBox(parent->map_T_node.Inverse(), inner));
}

}  // namespace

void FitParents(const std::vector<Layer>& layers, const std::vector<Edge>& edges,
                std::vector<Node>* nodes) {
  std::unordered_map<LayerId, int32_t> rank_of;
  for (const Layer& layer : layers) rank_of[layer.id] = layer.rank;
  std::unordered_map<NodeId, size_t> index_of;
  for (size_t i = 0; i < nodes->size(); ++i) index_of[(*nodes)[i].id] = i;
  std::vector<Link> links;
  for (const Edge& edge : edges) {
    if (edge.relation != relations::kContains) continue;
    const auto parent = index_of.find(edge.source);
    const auto child = index_of.find(edge.target);
    if (parent == index_of.end() || child == index_of.end()) continue;
    links.push_back({rank_of[(*nodes)[child->second].layer], parent->second, child->second});
  }
  // Ranks fall from parent to child, so a child is done before it is looked at.
  std::stable_sort(links.begin(), links.end(),
                   [](const Link& a, const Link& b) { return a.child_rank < b.child_rank; });
  for (const Link& link : links) GrowOver((*nodes)[link.child], &(*nodes)[link.parent]);
}

}  // namespace dsg::merge
