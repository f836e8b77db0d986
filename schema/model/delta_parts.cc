// SPDX-License-Identifier: Apache-2.0
#include "schema/model/delta_parts.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

namespace dsg {
namespace {

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

}  // namespace

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

}  // namespace dsg
