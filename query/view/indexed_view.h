// SPDX-License-Identifier: Apache-2.0
// The graph view that answers from indexes, and how one is made from another.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "query/view/cow_tree.h"
#include "query/view/edge_index.h"
#include "query/view/graph_view.h"
#include "query/view/place_graph.h"
#include "query/view/space_index.h"
#include "schema/base/cache.h"

namespace dsg::query {

struct NodeTraits {
  using Entry = ViewNode;
  using Key = NodeId;
  using Summary = NoSummary;
  // Small: a changed node copies its leaf.
  static constexpr int kLeafEntries = 16;
  static constexpr int kChildren = 64;
  static Key KeyOf(const ViewNode& node) { return node.id; }
};

struct NameTraits {
  using Entry = std::pair<Symbol, NodeId>;
  using Key = Entry;
  using Summary = NoSummary;
  static constexpr int kLeafEntries = 64;
  static constexpr int kChildren = 64;
  static const Key& KeyOf(const Entry& entry) { return entry; }
};

/// The indexes of a view, kept in step with each other while they are made or changed.
///
/// Threads: as CowTree.
class ViewParts {
 public:
  explicit ViewParts(std::shared_ptr<SymbolTable> symbols);

  ViewNode ToView(const Node& node);
  ViewEdge ToView(const Edge& edge);

  /// Replaces all nodes; in any order, of several with the same id any is kept.
  /// Errors: what `stop` returned; the view is then of no use.
  absl::Status FillNodes(std::vector<ViewNode> nodes, const StopCheck& stop);
  absl::Status FillEdges(std::vector<ViewEdge> edges, const StopCheck& stop);

  /// Shares all pages with the original.
  ViewParts Fork() const;
  void PutNode(ViewNode node);
  /// False if there is none.
  bool EraseNode(NodeId id);
  EdgeIndex& edges() { return edges_; }
  void SetLayers(std::vector<Layer> layers) { layers_ = std::move(layers); }

  const std::shared_ptr<SymbolTable>& symbols() const { return symbols_; }
  const std::vector<Layer>& layers() const { return layers_; }
  const CowTree<NodeTraits>& nodes() const { return nodes_; }
  const CowTree<NameTraits>& names() const { return names_; }
  const SpaceTree& space() const { return space_; }
  const EdgeIndex& edges() const { return edges_; }
  const std::map<std::pair<LayerId, Symbol>, int64_t>& class_counts() const {
    return class_counts_;
  }
  Symbol contains() const { return contains_; }

  size_t memory_bytes() const;
  /// Of what is not shared with the original of a fork.
  size_t fresh_bytes() const;

 private:
  void SetAttributes(const Attributes& attributes, ViewNode* view);
  bool IsAgent(const ViewNode& node) const {
    return std::find(agents_.begin(), agents_.end(), node.kind) != agents_.end();
  }
  void CountNode(const ViewNode& node, int64_t change);

  std::shared_ptr<SymbolTable> symbols_;
  Symbol contains_;
  /// The kinds of agents.
  std::vector<Symbol> agents_;
  std::vector<Layer> layers_;
  CowTree<NodeTraits> nodes_;
  CowTree<NameTraits> names_;
  SpaceTree space_;
  EdgeIndex edges_;
  std::map<std::pair<LayerId, Symbol>, int64_t> class_counts_;
  int64_t attribute_bytes_ = 0;
};

/// The places of one or more views, made by the first that asks.
struct SharedPlaces {
  MakeOnce<const PlaceGraph> graph;

  /// Grows with what planning keeps beside the graph.
  size_t memory_bytes() const {
    const PlaceGraph* made = graph.MadeOrNull();
    return made == nullptr ? 0 : made->memory_bytes();
  }
};

class IndexedView : public GraphView {
 public:
  IndexedView(Revision revision, ViewParts parts, std::shared_ptr<SharedPlaces> places)
      : revision_(revision), parts_(std::move(parts)), places_(std::move(places)) {}

  static absl::StatusOr<std::shared_ptr<const IndexedView>> Load(
      const Snapshot& snapshot, std::shared_ptr<SymbolTable> symbols, const StopCheck& stop);
  /// `touched`: all that may differ between `from` and `snapshot`.
  static absl::StatusOr<std::shared_ptr<const IndexedView>> Derive(const IndexedView& from,
                                                                   const Touched& touched,
                                                                   const Snapshot& snapshot,
                                                                   const StopCheck& stop);

  const ViewParts& parts() const { return parts_; }
  const std::shared_ptr<SharedPlaces>& shared_places() const { return places_; }
  /// What this view holds beside that which it shares with the one it was derived from.
  size_t fresh_bytes() const { return parts_.fresh_bytes(); }

  Revision revision() const override { return revision_; }
  const SymbolTable& symbols() const override { return *parts_.symbols(); }
  const std::vector<Layer>& layers() const override { return parts_.layers(); }
  int64_t node_count() const override { return static_cast<int64_t>(parts_.nodes().size()); }
  int64_t edge_count() const override { return parts_.edges().size(); }
  size_t memory_bytes() const override;

  const ViewNode* FindNode(NodeId id) const override { return parts_.nodes().Find(id); }
  void ForEachNode(NodeId after, const std::function<bool(const ViewNode&)>& visit) const override;
  std::vector<NodeId> NodesNamed(std::string_view name) const override;
  std::vector<NodeId> NodesNamedIgnoringCase(std::string_view name) const override;
  void ForEachOfClass(LayerId layer, Symbol class_name,
                      const std::function<bool(const ViewNode&)>& visit) const override;
  void ForEachInLayer(LayerId layer,
                      const std::function<bool(const ViewNode&)>& visit) const override;
  std::vector<std::pair<Symbol, int64_t>> ClassesOf(LayerId layer) const override;

  void ForEachEdgeFrom(NodeId source,
                       const std::function<bool(const ViewEdge&)>& visit) const override;
  void ForEachEdgeFrom(NodeId source, Symbol relation,
                       const std::function<bool(const ViewEdge&)>& visit) const override;
  void ForEachEdgeTo(NodeId target,
                     const std::function<bool(const ViewEdge&)>& visit) const override;
  void ForEachEdgeTo(NodeId target, Symbol relation,
                     const std::function<bool(const ViewEdge&)>& visit) const override;

  NodeId Parent(NodeId id) const override;
  std::vector<NodeId> Ancestors(NodeId id) const override;
  void ForEachDescendant(NodeId id,
                         const std::function<bool(const ViewNode&)>& visit) const override;

  void ForEachNearest(
      const Eigen::Vector3d& point_map, const SpaceFilter& filter, double distance_m_max,
      const std::function<bool(const ViewNode&, double distance_m)>& visit) const override;
  void ForEachTouching(const Box3d& box_map, const SpaceFilter& filter,
                       const std::function<bool(const ViewNode&)>& visit) const override;

  absl::StatusOr<std::shared_ptr<const PlaceGraph>> Places(const StopCheck& stop) const override;

 private:
  std::vector<SpaceRange> RangesOf(const SpaceFilter& filter) const;
  void ForEachInRange(const SpaceRange& range,
                      const std::function<bool(const ViewNode&)>& visit) const;
  void AppendNodesNamed(Symbol name, std::vector<NodeId>* ids) const;

  const Revision revision_;
  const ViewParts parts_;
  const std::shared_ptr<SharedPlaces> places_;
};

}  // namespace dsg::query
