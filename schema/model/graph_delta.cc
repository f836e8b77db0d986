// SPDX-License-Identifier: Apache-2.0
#include "schema/model/graph_delta.h"

#include <algorithm>
#include <unordered_map>

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

// Fills deltas one after another, opening the next when the current one is full.
class DeltaSplitter {
 public:
  DeltaSplitter(const GraphDelta& header, size_t item_count_max)
      : header_(header), item_count_max_(std::max<size_t>(item_count_max, 1)) {}

  GraphDelta& Room(size_t item_count) {
    if (parts_.empty() || (used_ > 0 && used_ + item_count > item_count_max_)) Open();
    used_ += item_count;
    return parts_.back();
  }

  template <typename T>
  void Add(std::vector<T>& items, std::vector<T> GraphDelta::*part) {
    for (T& item : items) (Room(1).*part).push_back(std::move(item));
  }

  // Cuts `rows`, which belong to `append` (whose own are not used), wherever a delta is full.
  template <typename T, typename Row>
  void AddSeries(const std::vector<Row>& rows, T append, std::vector<Row> T::*series,
                 std::vector<T> GraphDelta::*appends) {
    size_t next = 0;
    while (next < rows.size()) {
      GraphDelta& part = Room(1);
      const size_t space = item_count_max_ > used_ ? item_count_max_ - used_ + 1 : 1;
      const size_t count = std::min(space, rows.size() - next);
      const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(next);
      (append.*series).assign(begin, begin + static_cast<std::ptrdiff_t>(count));
      (part.*appends).push_back(append);
      used_ += count - 1;
      next += count;
    }
  }

  std::vector<GraphDelta> Take() && { return std::move(parts_); }

 private:
  void Open() {
    GraphDelta part;
    part.map = header_.map;
    part.session_id = header_.session_id;
    part.sequence = header_.sequence + static_cast<int64_t>(parts_.size());
    if (parts_.empty()) part.parent_revision = header_.parent_revision;
    part.author = header_.author;
    part.message = header_.message;
    part.config_digest = header_.config_digest;
    part.is_forgetting = header_.is_forgetting;
    parts_.push_back(std::move(part));
    used_ = 0;
  }

  const GraphDelta& header_;
  size_t item_count_max_;
  size_t used_ = 0;
  std::vector<GraphDelta> parts_;
};

void SortParentsFirst(GraphDelta* delta) {
  std::unordered_map<LayerId, int32_t> rank_of;
  for (const Layer& layer : DefaultLayers()) rank_of[layer.id] = layer.rank;
  for (const Layer& layer : delta->layers) rank_of[layer.id] = layer.rank;
  std::stable_sort(delta->nodes.begin(), delta->nodes.end(), [&](const Node& a, const Node& b) {
    return rank_of[a.layer] != rank_of[b.layer] ? rank_of[a.layer] > rank_of[b.layer] : a.id < b.id;
  });
}

}  // namespace

bool GraphDelta::empty() const {
  return layers.empty() && labels.empty() && nodes.empty() && retirements.empty() &&
         edges.empty() && edge_removals.empty() && appends.empty() && corrections.empty() &&
         factor_removals.empty() && factors.empty() && shape_removals.empty() && shapes.empty() &&
         stay_removals.empty() && stays.empty() && mesh_blocks.empty() && mesh_removals.empty() &&
         assets.empty();
}

void FitBoxesToChildren(GraphDelta* delta) { BoxFitter(delta).Fit(); }

std::vector<GraphDelta> SplitDelta(GraphDelta delta, size_t item_count_max) {
  SortParentsFirst(&delta);
  DeltaSplitter splitter(delta, item_count_max);
  splitter.Add(delta.layers, &GraphDelta::layers);
  splitter.Add(delta.labels, &GraphDelta::labels);
  splitter.Add(delta.assets, &GraphDelta::assets);
  splitter.Add(delta.factor_removals, &GraphDelta::factor_removals);
  splitter.Add(delta.shape_removals, &GraphDelta::shape_removals);
  splitter.Add(delta.stay_removals, &GraphDelta::stay_removals);
  splitter.Add(delta.edge_removals, &GraphDelta::edge_removals);
  splitter.Add(delta.mesh_removals, &GraphDelta::mesh_removals);
  splitter.Add(delta.retirements, &GraphDelta::retirements);
  splitter.Add(delta.nodes, &GraphDelta::nodes);
  splitter.Add(delta.edges, &GraphDelta::edges);
  for (const TrajectoryAppend& append : delta.appends) {
    splitter.AddSeries(append.poses, {append.agent, {}}, &TrajectoryAppend::poses,
                       &GraphDelta::appends);
  }
  splitter.Add(delta.corrections, &GraphDelta::corrections);
  splitter.Add(delta.factors, &GraphDelta::factors);
  for (const ShapeAppend& append : delta.shapes) {
    splitter.AddSeries(append.shapes, {append.agent, append.topology, {}}, &ShapeAppend::shapes,
                       &GraphDelta::shapes);
  }
  splitter.Add(delta.stays, &GraphDelta::stays);
  for (MeshBlock& block : delta.mesh_blocks) {
    const size_t size = block.positions_map.size() + block.faces.size();
    splitter.Room(std::max<size_t>(size, 1)).mesh_blocks.push_back(std::move(block));
  }
  return std::move(splitter).Take();
}

}  // namespace dsg
