// SPDX-License-Identifier: Apache-2.0
#include "schema/model/graph_delta.h"

#include <unordered_map>
#include <utility>

#include "schema/model/delta_parts.h"

namespace dsg {
namespace {

// Post-order walk over the delta's own hierarchy. A cycle cannot hang it (each node is entered
// once); CheckDelta refuses the cycle later.
class BoxFitter {
 public:
  explicit BoxFitter(GraphDelta* delta) : delta_(delta) {
    for (size_t i = 0; i < delta->nodes.size(); ++i) index_of_[delta->nodes[i].id] = i;
    children_.resize(delta->nodes.size());
    for (const Edge& edge : delta->edges) {
      if (edge.relation != relations::kContains) continue;
      const auto parent = index_of_.find(edge.source);
      const auto child = index_of_.find(edge.target);
      if (parent != index_of_.end() && child != index_of_.end()) {
        children_[parent->second].push_back(child->second);
      }
    }
  }

  void Fit() {
    entered_.assign(delta_->nodes.size(), false);
    for (size_t root = 0; root < delta_->nodes.size(); ++root) FitBelow(root);
  }

 private:
  struct Frame {
    size_t node;
    size_t next_child = 0;
  };

  void FitBelow(size_t root) {
    if (entered_[root]) return;
    entered_[root] = true;
    std::vector<Frame> stack = {{root}};
    while (!stack.empty()) {
      Frame& top = stack.back();
      const auto& children = children_[top.node];
      if (top.next_child < children.size()) {
        const size_t child = children[top.next_child++];
        if (entered_[child]) continue;
        entered_[child] = true;
        stack.push_back({child});
      } else {
        GrowOverChildren(top.node);
        stack.pop_back();
      }
    }
  }

  void GrowOverChildren(size_t parent_index) {
    Node& parent = delta_->nodes[parent_index];
    const Pose3d node_T_map = parent.map_T_node.Inverse();
    for (const size_t child : children_[parent_index]) {
      const Box3d child_map = delta_->nodes[child].BoxMap();
      if (!parent.box_node.isEmpty() && parent.BoxMap().contains(child_map)) continue;
      parent.box_node.extend(TransformBox(node_T_map, child_map));
    }
  }

  GraphDelta* delta_;
  std::unordered_map<NodeId, size_t> index_of_;
  std::vector<std::vector<size_t>> children_;
  std::vector<bool> entered_;
};

}  // namespace

bool GraphDelta::empty() const {
  return layers.empty() && labels.empty() && nodes.empty() && node_patches.empty() &&
         edge_patches.empty() && retirements.empty() && edges.empty() && edge_removals.empty() &&
         appends.empty() && corrections.empty() && factor_removals.empty() && factors.empty() &&
         shape_removals.empty() && shapes.empty() && stay_removals.empty() && stays.empty() &&
         mesh_blocks.empty() && mesh_removals.empty() && assets.empty();
}

void FitBoxesToChildren(GraphDelta* delta) { BoxFitter(delta).Fit(); }

std::vector<GraphDelta> SplitDelta(GraphDelta delta, size_t item_count_max) {
  std::vector<GraphDelta> parts;
  const absl::Status kept =
      ForEachPart(std::move(delta), item_count_max, [&](GraphDelta part, double) {
        parts.push_back(std::move(part));
        return absl::OkStatus();
      });
  kept.IgnoreError();
  return parts;
}

}  // namespace dsg
