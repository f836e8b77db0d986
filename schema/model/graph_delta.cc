// SPDX-License-Identifier: Apache-2.0
#include "schema/model/graph_delta.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

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

// Of a mesh block in a delta.
size_t RowsOf(const MeshBlock& block) {
  return std::max<size_t>(block.positions_map.size() + block.faces.size(), 1);
}

template <typename T, typename Row>
size_t RowsOf(const std::vector<T>& series, std::vector<Row> T::*rows) {
  size_t count = 0;
  for (const T& one : series) count += (one.*rows).size();
  return count;
}

size_t RowsOf(const GraphDelta& delta) {
  size_t count = delta.nodes.size() + delta.edges.size() + delta.stays.size() +
                 RowsOf(delta.appends, &TrajectoryAppend::poses) +
                 RowsOf(delta.shapes, &ShapeAppend::shapes);
  for (const MeshBlock& block : delta.mesh_blocks) count += RowsOf(block);
  return std::max<size_t>(count, 1);
}

// Parents before children, by rank. Places only: to sort the nodes themselves would take them
// twice.
std::vector<size_t> ParentsFirst(const GraphDelta& delta) {
  std::unordered_map<LayerId, int32_t> rank_of;
  for (const Layer& layer : DefaultLayers()) rank_of[layer.id] = layer.rank;
  for (const Layer& layer : delta.layers) rank_of[layer.id] = layer.rank;
  std::vector<size_t> order(delta.nodes.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto rank = [&](size_t i) {
    const auto found = rank_of.find(delta.nodes[i].layer);
    return found == rank_of.end() ? 0 : found->second;
  };
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return rank(a) != rank(b) ? rank(a) > rank(b) : delta.nodes[a].id < delta.nodes[b].id;
  });
  return order;
}

// Index before letter, as stores keep rows: what belongs together is looked up and written
// together.
std::vector<size_t> SourcesInOrder(const std::vector<Edge>& edges) {
  std::vector<size_t> order(edges.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto key = [&](size_t i) { return KeyOf(edges[i].source); };
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
  return order;
}

// Fills one part after another, giving each away when the next begins.
class DeltaSplitter {
 public:
  DeltaSplitter(const GraphDelta& header, size_t item_count_max, const TakePart& take)
      : header_(header),
        item_count_max_(std::max<size_t>(item_count_max, 1)),
        row_count_(static_cast<double>(RowsOf(header))),
        take_(take) {}

  GraphDelta& Room(size_t item_count) {
    if (!is_open_ || (used_ > 0 && used_ + item_count > item_count_max_)) Open();
    used_ += item_count;
    return part_;
  }

  template <typename T>
  void Add(std::vector<T>& items, std::vector<T> GraphDelta::*part) {
    for (size_t i = 0; i < items.size() && status_.ok(); ++i) {
      Push(std::move(items[i]), items.size() - i, &(Room(1).*part));
    }
  }

  template <typename T>
  void Add(std::vector<T>& items, const std::vector<size_t>& order,
           std::vector<T> GraphDelta::*part) {
    for (size_t i = 0; i < order.size() && status_.ok(); ++i) {
      Push(std::move(items[order[i]]), order.size() - i, &(Room(1).*part));
    }
  }

  void AddBlocks(std::vector<MeshBlock>& blocks) {
    for (size_t i = 0; i < blocks.size() && status_.ok(); ++i) {
      Room(RowsOf(blocks[i])).mesh_blocks.push_back(std::move(blocks[i]));
    }
  }

  // Cuts `rows`, which belong to `append` (whose own are not used), wherever a delta is full.
  template <typename T, typename Row>
  void AddSeries(const std::vector<Row>& rows, T append, std::vector<Row> T::*series,
                 std::vector<T> GraphDelta::*appends) {
    size_t next = 0;
    while (next < rows.size() && status_.ok()) {
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

  absl::Status End() && {
    Give();
    return status_;
  }

 private:
  // Room for all that may come: nodes and edges are large, and a list that grows copies them.
  template <typename T>
  void Push(T item, size_t left, std::vector<T>* items) {
    if (items->empty())
      items->reserve(std::min(left, item_count_max_ - std::min(item_count_max_, used_) + 1));
    items->push_back(std::move(item));
  }

  void Give() {
    if (!is_open_ || !status_.ok()) return;
    done_ += static_cast<double>(used_);
    status_ = take_(std::move(part_), std::min(1.0, done_ / row_count_));
  }

  void Open() {
    Give();
    part_ = GraphDelta();
    part_.map = header_.map;
    part_.session_id = header_.session_id;
    part_.sequence = header_.sequence + part_count_;
    if (part_count_ == 0) part_.parent_revision = header_.parent_revision;
    part_.author = header_.author;
    part_.message = header_.message;
    part_.config_digest = header_.config_digest;
    part_.is_forgetting = header_.is_forgetting;
    ++part_count_;
    is_open_ = true;
    used_ = 0;
  }

  const GraphDelta& header_;
  size_t item_count_max_;
  double row_count_;
  const TakePart& take_;
  GraphDelta part_;
  bool is_open_ = false;
  int64_t part_count_ = 0;
  size_t used_ = 0;
  double done_ = 0.0;
  absl::Status status_;
};

// Sorts by key and keeps the last of equal keys: what was said last is what is meant.
template <typename T, typename KeyOf>
void SortKeepLast(std::vector<T>* items, KeyOf key_of) {
  const auto less = [&](const T& a, const T& b) { return key_of(a) < key_of(b); };
  if (!std::is_sorted(items->begin(), items->end(), less)) {
    std::stable_sort(items->begin(), items->end(), less);
  }
  size_t kept = 0;
  for (size_t i = 0; i < items->size(); ++i) {
    const bool superseded = i + 1 < items->size() && !less((*items)[i], (*items)[i + 1]);
    if (superseded) continue;
    if (kept != i) (*items)[kept] = std::move((*items)[i]);
    ++kept;
  }
  items->erase(items->begin() + static_cast<std::ptrdiff_t>(kept), items->end());
}

// Joins what is appended to one agent, in the order given.
template <typename T, typename Payload>
void MergeByAgent(std::vector<T>* items, Payload T::*payload) {
  std::stable_sort(items->begin(), items->end(),
                   [](const T& a, const T& b) { return a.agent < b.agent; });
  std::vector<T> merged;
  for (T& item : *items) {
    if (merged.empty() || merged.back().agent != item.agent) {
      merged.push_back(std::move(item));
      continue;
    }
    auto& into = merged.back().*payload;
    auto& from = item.*payload;
    into.insert(into.end(), std::make_move_iterator(from.begin()),
                std::make_move_iterator(from.end()));
  }
  *items = std::move(merged);
}

// Joins what is appended to one agent on one topology. Of two shapes of one time the later said
// stands, as between revisions: an estimate and its correction may come in one delta.
void MergeShapes(std::vector<ShapeAppend>* items) {
  const auto key = [](const ShapeAppend& item) { return std::tie(item.agent, item.topology); };
  std::stable_sort(items->begin(), items->end(),
                   [&](const auto& a, const auto& b) { return key(a) < key(b); });
  std::vector<ShapeAppend> merged;
  for (ShapeAppend& item : *items) {
    if (merged.empty() || key(merged.back()) != key(item)) {
      merged.push_back(std::move(item));
      continue;
    }
    std::vector<BodyShape>& into = merged.back().shapes;
    std::move(item.shapes.begin(), item.shapes.end(), std::back_inserter(into));
    SortKeepLast(&into, [](const BodyShape& shape) { return shape.time_ns; });
  }
  *items = std::move(merged);
}

}  // namespace

bool GraphDelta::empty() const {
  return layers.empty() && labels.empty() && nodes.empty() && node_patches.empty() &&
         edge_patches.empty() && retirements.empty() && edges.empty() && edge_removals.empty() &&
         appends.empty() && corrections.empty() && factor_removals.empty() && factors.empty() &&
         shape_removals.empty() && shapes.empty() && stay_removals.empty() && stays.empty() &&
         mesh_blocks.empty() && mesh_removals.empty() && assets.empty();
}

void FitBoxesToChildren(GraphDelta* delta) { BoxFitter(delta).Fit(); }

void Coalesce(GraphDelta* delta) {
  SortKeepLast(&delta->layers, [](const Layer& layer) { return layer.id; });
  SortKeepLast(&delta->labels, [](const SemanticLabel& label) { return label.id; });
  SortKeepLast(&delta->nodes, [](const Node& node) { return node.id; });
  SortKeepLast(&delta->retirements, [](const Retirement& item) { return item.id; });
  const auto edge_key = [](const Edge& edge) {
    return std::tie(edge.source, edge.relation, edge.target);
  };
  SortKeepLast(&delta->edges, edge_key);
  SortKeepLast(&delta->edge_removals, [](const EdgeKey& key) { return key; });
  if (!delta->edge_removals.empty()) {
    std::erase_if(delta->edges, [&](const Edge& edge) {
      return std::binary_search(delta->edge_removals.begin(), delta->edge_removals.end(),
                                edge.key());
    });
  }
  MergeByAgent(&delta->appends, &TrajectoryAppend::poses);
  MergeByAgent(&delta->factors, &FactorAppend::factors);
  MergeShapes(&delta->shapes);
  SortKeepLast(&delta->corrections, [](const TrajectoryCorrection& item) {
    return std::make_tuple(item.agent, item.from_ns);
  });
  const auto span_key = [](const TrackSpan& span) {
    return std::make_tuple(span.agent, span.from_ns, span.to_ns);
  };
  SortKeepLast(&delta->factor_removals, span_key);
  SortKeepLast(&delta->shape_removals, span_key);
  SortKeepLast(&delta->stay_removals, [](const StayKey& key) { return key; });
  SortKeepLast(&delta->stays,
               [](const Stay& stay) { return std::make_tuple(stay.agent, stay.enter_ns); });
  SortKeepLast(&delta->mesh_blocks, [](const MeshBlock& block) { return block.index; });
  SortKeepLast(&delta->mesh_removals, [](const BlockIndex& index) { return index; });
  SortKeepLast(&delta->assets, [](const Asset& asset) { return asset.sha256; });
}

absl::Status ForEachPart(GraphDelta delta, size_t item_count_max, const TakePart& take) {
  const std::vector<size_t> node_order = ParentsFirst(delta);
  const std::vector<size_t> edge_order = SourcesInOrder(delta.edges);
  DeltaSplitter splitter(delta, item_count_max, take);
  splitter.Add(delta.layers, &GraphDelta::layers);
  splitter.Add(delta.labels, &GraphDelta::labels);
  splitter.Add(delta.assets, &GraphDelta::assets);
  splitter.Add(delta.factor_removals, &GraphDelta::factor_removals);
  splitter.Add(delta.shape_removals, &GraphDelta::shape_removals);
  splitter.Add(delta.stay_removals, &GraphDelta::stay_removals);
  splitter.Add(delta.edge_removals, &GraphDelta::edge_removals);
  splitter.Add(delta.mesh_removals, &GraphDelta::mesh_removals);
  splitter.Add(delta.retirements, &GraphDelta::retirements);
  splitter.Add(delta.nodes, node_order, &GraphDelta::nodes);
  splitter.Add(delta.node_patches, &GraphDelta::node_patches);
  splitter.Add(delta.edges, edge_order, &GraphDelta::edges);
  splitter.Add(delta.edge_patches, &GraphDelta::edge_patches);
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
  splitter.AddBlocks(delta.mesh_blocks);
  return std::move(splitter).End();
}

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
