// SPDX-License-Identifier: Apache-2.0
// The indexes that a view consists of, kept in step with each other while they are made or changed.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "query/view/cow_tree.h"
#include "query/view/edge_index.h"
#include "query/view/graph_view.h"
#include "query/view/space_index.h"

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

/// Threads: as CowTree.
class ViewParts {
 public:
  explicit ViewParts(std::shared_ptr<SymbolTable> symbols);

  ViewNode ToView(const Node& node);
  /// Takes its attributes.
  ViewNode ToView(Node&& node);
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
  ViewNode WithoutAttributes(const Node& node);
  bool IsAgent(const ViewNode& node) const { return node.kind == human_ || node.kind == robot_; }
  void CountNode(const ViewNode& node, int64_t change);

  std::shared_ptr<SymbolTable> symbols_;
  Symbol contains_;
  Symbol human_;
  Symbol robot_;
  std::vector<Layer> layers_;
  CowTree<NodeTraits> nodes_;
  CowTree<NameTraits> names_;
  SpaceTree space_;
  EdgeIndex edges_;
  std::map<std::pair<LayerId, Symbol>, int64_t> class_counts_;
  int64_t attribute_bytes_ = 0;
};

}  // namespace dsg::query
