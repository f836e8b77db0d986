// SPDX-License-Identifier: Apache-2.0
// How a view is read from a snapshot, whole or from what was touched since another view.
#include <algorithm>

#include "query/view/indexed_view.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Entities read at once: no more of them are in memory than these and those of the view.
constexpr size_t kBatchEntities = 256;

absl::Status CheckStop(const StopCheck& stop) { return stop ? stop() : absl::OkStatus(); }

// Reads what was touched, as it is at a snapshot, into a fork of an older or newer view.
class Update {
 public:
  Update(const IndexedView& from, const Snapshot& snapshot, const StopCheck& stop)
      : from_(from), parts_(from.parts().Fork()), snapshot_(snapshot), stop_(stop) {}

  absl::Status Apply(const Touched& touched) {
    if (touched.layers_or_labels) {
      DSG_ASSIGN_OR_RETURN(auto layers, snapshot_.Layers());
      parts_.SetLayers(std::move(layers));
    }
    for (const auto& ids : Batches(touched.nodes)) {
      DSG_ASSIGN_OR_RETURN(auto nodes, snapshot_.FindNodes(ids, stop_));
      for (size_t i = 0; i < ids.size(); ++i) UpdateNode(ids[i], std::move(nodes[i]));
    }
    for (const auto& keys : Batches(touched.edges)) {
      DSG_ASSIGN_OR_RETURN(const auto edges, snapshot_.FindEdges(keys, stop_));
      for (size_t i = 0; i < keys.size(); ++i) UpdateEdge(keys[i], edges[i]);
    }
    return absl::OkStatus();
  }

  std::shared_ptr<const IndexedView> Finish() {
    return std::make_shared<IndexedView>(
        snapshot_.revision(), std::move(parts_),
        places_differ_ ? std::make_shared<SharedPlaces>() : from_.shared_places());
  }

 private:
  template <typename Key>
  static std::vector<std::vector<Key>> Batches(const std::vector<Key>& keys) {
    std::vector<std::vector<Key>> batches;
    for (size_t first = 0; first < keys.size(); first += kBatchEntities) {
      const size_t last = std::min(first + kBatchEntities, keys.size());
      batches.emplace_back(keys.begin() + static_cast<std::ptrdiff_t>(first),
                           keys.begin() + static_cast<std::ptrdiff_t>(last));
    }
    return batches;
  }

  void UpdateNode(NodeId id, std::optional<Node> node) {
    const ViewNode* before = from_.FindNode(id);
    const LayerId layer_before = before != nullptr ? before->layer : 0;
    const LayerId layer_after = node.has_value() ? node->layer : 0;
    places_differ_ = places_differ_ || layer_before == layers::kPlaces ||
                     layer_after == layers::kPlaces ||
                     (before != nullptr && node.has_value() && layer_before != layer_after);
    if (node.has_value()) {
      parts_.PutNode(parts_.ToView(*std::move(node)));
    } else {
      parts_.EraseNode(id);
    }
  }

  // What a place is linked to and which room it is in. Only objects are below places, so what
  // contains them is of no concern.
  bool ConcernsPlaces(const EdgeKey& key) const {
    if (key.relation == relations::kTraversable) return true;
    if (key.relation != relations::kContains) return false;
    const ViewNode* before = from_.FindNode(key.target);
    const ViewNode* target = before != nullptr ? before : parts_.nodes().Find(key.target);
    return target == nullptr || target->layer != layers::kObjects;
  }

  void UpdateEdge(const EdgeKey& key, const std::optional<Edge>& edge) {
    places_differ_ = places_differ_ || ConcernsPlaces(key);
    if (edge.has_value()) {
      parts_.edges().Put(parts_.ToView(*edge));
    } else {
      parts_.edges().Erase(key.source, parts_.symbols()->Intern(key.relation), key.target);
    }
  }

  const IndexedView& from_;
  ViewParts parts_;
  const Snapshot& snapshot_;
  const StopCheck& stop_;
  bool places_differ_ = false;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const IndexedView>> IndexedView::Load(
    const Snapshot& snapshot, std::shared_ptr<SymbolTable> symbols, const StopCheck& stop) {
  ViewParts parts(std::move(symbols));
  DSG_ASSIGN_OR_RETURN(auto layers, snapshot.Layers());
  parts.SetLayers(std::move(layers));
  std::vector<ViewNode> nodes;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadAllNodes(stop, [&](const Node& node) { nodes.push_back(parts.ToView(node)); }));
  DSG_RETURN_IF_ERROR(parts.FillNodes(std::move(nodes), stop));
  std::vector<ViewEdge> edges;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadAllEdges(stop, [&](const Edge& edge) { edges.push_back(parts.ToView(edge)); }));
  DSG_RETURN_IF_ERROR(CheckStop(stop));
  DSG_RETURN_IF_ERROR(parts.FillEdges(std::move(edges), stop));
  return std::make_shared<const IndexedView>(snapshot.revision(), std::move(parts),
                                             std::make_shared<SharedPlaces>());
}

absl::StatusOr<std::shared_ptr<const IndexedView>> IndexedView::Derive(const IndexedView& from,
                                                                       const Touched& touched,
                                                                       const Snapshot& snapshot,
                                                                       const StopCheck& stop) {
  Update update(from, snapshot, stop);
  DSG_RETURN_IF_ERROR(update.Apply(touched));
  return update.Finish();
}

}  // namespace dsg::query
