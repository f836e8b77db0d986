// SPDX-License-Identifier: Apache-2.0
// The graph of one revision in memory, with the indexes that questions need: by id, by name, by
// class, by place in space, by edge in both directions, by hierarchy. What grows with time (poses,
// stays, shapes) or is large (mesh) stays in the Snapshot.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

/// 0 is the empty text.
using Symbol = uint32_t;

/// Names as small numbers: every kind, class, relation and node name of a map once, shared by all
/// its views. Never forgets, so a number means the same in every revision.
///
/// Threads: safe from many threads; Text waits for nobody.
class SymbolTable {
 public:
  SymbolTable();
  ~SymbolTable();

  /// The number of a text, a new one if it has none yet.
  Symbol Intern(std::string_view text);
  /// nullopt if no view of this map has ever held the text.
  std::optional<Symbol> Find(std::string_view text) const;
  /// The texts that are equal to this one but for the case of the letters A to Z. Ascending.
  std::vector<Symbol> FindIgnoringCase(std::string_view text) const;
  /// Valid as long as the table. Requires: `symbol` came from here.
  const std::string& Text(Symbol symbol) const;

  size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class PlaceGraph;

struct ViewAttribute {
  Symbol name = 0;
  AttributeValue value;
};

/// What a view keeps of a node. The rest (observations, assets, footprints) is in the Snapshot.
struct ViewNode {
  NodeId id;
  LayerId layer = 0;
  Symbol kind = 0;
  Symbol class_name = 0;
  int32_t class_id = -1;
  Symbol name = 0;
  /// Only objects have one, and not all.
  std::optional<Color> color;
  /// Here it fills a gap before the pose: the smaller a node, the more of them are in the
  /// processor's cache.
  uint32_t attribute_count = 0;
  Pose3d map_T_node;
  /// Empty = no extent.
  Box3d box_node;
  Interval valid;
  /// Of places, metres; 0 for all others.
  double clearance_m = 0.0;
  std::shared_ptr<const ViewAttribute[]> attribute_array;

  /// Without those of attributes::IsFileRest.
  std::span<const ViewAttribute> attributes() const {
    return {attribute_array.get(), attribute_count};
  }

  /// As Node::BoxMap.
  Box3d BoxMap() const {
    return box_node.isEmpty() ? Box3d(map_T_node.position) : TransformBox(map_T_node, box_node);
  }
  /// As Node::DistanceTo.
  double DistanceTo(const Eigen::Vector3d& point_map) const {
    return DistanceToBox(point_map, map_T_node, box_node);
  }
};

struct ViewEdge {
  NodeId source;
  NodeId target;
  Symbol relation = 0;
  double weight = 1.0;
  Interval valid;
};

/// Narrows a search in space; an unset field narrows nothing.
struct SpaceFilter {
  std::optional<LayerId> layer;
  std::optional<Symbol> class_name;
};

/// Threads: immutable, so safe from many threads. Shares what has not changed with the views of
/// neighbouring revisions.
class GraphView {
 public:
  /// Reads a whole revision.
  /// Errors: as Snapshot's; what `stop` returned. Cost: see docs/performance.md.
  static absl::StatusOr<std::shared_ptr<const GraphView>> Load(const Snapshot& snapshot,
                                                               std::shared_ptr<SymbolTable> symbols,
                                                               const StopCheck& stop);
  /// The view of `snapshot`, from a view of the same map at an earlier or later revision.
  /// Cost: that of what differs. Errors: as Load.
  static absl::StatusOr<std::shared_ptr<const GraphView>> Derive(
      std::shared_ptr<const GraphView> from, MapReader* map, const Snapshot& snapshot,
      const StopCheck& stop);

  virtual ~GraphView() = default;

  virtual Revision revision() const = 0;
  virtual const SymbolTable& symbols() const = 0;
  /// Ascending by rank, then name.
  virtual const std::vector<Layer>& layers() const = 0;
  virtual int64_t node_count() const = 0;
  virtual int64_t edge_count() const = 0;
  /// Estimate of what this view holds, shared parts included, symbols not.
  virtual size_t memory_bytes() const = 0;

  /// Null if there is none. Valid as long as the view.
  virtual const ViewNode* FindNode(NodeId id) const = 0;
  /// Ascending id, from the first above `after`, until `visit` returns false.
  virtual void ForEachNode(NodeId after,
                           const std::function<bool(const ViewNode&)>& visit) const = 0;
  /// Exactly this name. Ascending id.
  virtual std::vector<NodeId> NodesNamed(std::string_view name) const = 0;
  /// The same, but for the case of the letters A to Z.
  virtual std::vector<NodeId> NodesNamedIgnoringCase(std::string_view name) const = 0;
  /// Nodes of a layer and class (`class_name` 0 = without class), agents included, in no useful
  /// order, until `visit` returns false.
  virtual void ForEachOfClass(LayerId layer, Symbol class_name,
                              const std::function<bool(const ViewNode&)>& visit) const = 0;
  /// The same over all classes of a layer.
  virtual void ForEachInLayer(LayerId layer,
                              const std::function<bool(const ViewNode&)>& visit) const = 0;
  /// Classes of a layer, with how many nodes each has. Ascending symbol.
  virtual std::vector<std::pair<Symbol, int64_t>> ClassesOf(LayerId layer) const = 0;

  /// Edges from a node, ascending by relation's symbol, then target, until `visit` returns false.
  virtual void ForEachEdgeFrom(NodeId source,
                               const std::function<bool(const ViewEdge&)>& visit) const = 0;
  /// Edges of one relation from a node; ascending target.
  virtual void ForEachEdgeFrom(NodeId source, Symbol relation,
                               const std::function<bool(const ViewEdge&)>& visit) const = 0;
  /// Edges to a node, ascending by relation's symbol, then source.
  virtual void ForEachEdgeTo(NodeId target,
                             const std::function<bool(const ViewEdge&)>& visit) const = 0;
  virtual void ForEachEdgeTo(NodeId target, Symbol relation,
                             const std::function<bool(const ViewEdge&)>& visit) const = 0;

  /// By CONTAINS, as Snapshot::Ancestors: the lowest id where there are several; empty at the top.
  virtual NodeId Parent(NodeId id) const = 0;
  /// Nearest first.
  virtual std::vector<NodeId> Ancestors(NodeId id) const = 0;
  /// Below in the hierarchy, however many layers down, in the order of a walk in breadth.
  virtual void ForEachDescendant(NodeId id,
                                 const std::function<bool(const ViewNode&)>& visit) const = 0;

  /// By distance to the node's box, then id; agents left out, since they are where their tracks
  /// say; until `visit` returns false.
  virtual void ForEachNearest(
      const Eigen::Vector3d& point_map, const SpaceFilter& filter, double distance_m_max,
      const std::function<bool(const ViewNode&, double distance_m)>& visit) const = 0;
  /// Nodes whose boxes touch, agents left out, in no useful order.
  virtual void ForEachTouching(const Box3d& box_map, const SpaceFilter& filter,
                               const std::function<bool(const ViewNode&)>& visit) const = 0;

  /// Places and the links between them, made at the first call and shared with the views of
  /// neighbouring revisions while no place and no link differs. Errors: what `stop` returned.
  virtual absl::StatusOr<std::shared_ptr<const PlaceGraph>> Places(const StopCheck& stop) const = 0;
};

}  // namespace dsg::query
