// SPDX-License-Identifier: Apache-2.0
// Nodes of a view in memory: filtered as the store filters them, and written into replies with the
// bytes that the store would give.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "query/view/graph_view.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"

namespace dsg::v1 {
class Node;
}  // namespace dsg::v1

namespace dsg::query {

/// A NodeFilter in the symbols of a view; it admits what NodeFilter::Matches admits.
class ViewFilter {
 public:
  /// `graph` must outlive this.
  ViewFilter(const NodeFilter& filter, const GraphView& graph);

  /// Also whether it is a child of the filter's parent.
  bool Matches(const ViewNode& node) const;
  /// False if no node can match.
  bool CanMatch() const { return can_match_; }
  SpaceFilter space() const { return {filter_.layer, class_name_}; }

 private:
  bool IsChild(NodeId node) const;

  NodeFilter filter_;
  const GraphView& graph_;
  bool can_match_ = true;
  std::optional<Symbol> kind_;
  std::optional<Symbol> class_name_;
  std::optional<Symbol> name_;
};

/// Writes nodes of a view into replies: from memory if it holds the asked-for part of a node, else
/// from the store. Both give the same bytes.
///
/// Threads: one caller at a time.
class NodeFiller {
 public:
  /// `node_view` is a number of v1.NodeView. All must outlive this.
  NodeFiller(const Snapshot& snapshot, const GraphView& graph, int node_view);
  NodeFiller(const NodeFiller&) = delete;
  NodeFiller& operator=(const NodeFiller&) = delete;

  /// The nodes of the coming calls of Fill, in their order: those that must come from the store
  /// are then read many at a time.
  void Expect(std::vector<NodeId> ids);

  /// Errors: as Snapshot::GetNode.
  absl::Status Fill(const ViewNode& node, v1::Node* out) { return Fill(node, std::nullopt, out); }
  /// With `map_T_agent` in place of the pose, if given.
  absl::Status Fill(const ViewNode& node, const std::optional<Pose3d>& map_T_agent, v1::Node* out);

 private:
  bool IsInView() const;
  Node FromView(const ViewNode& node) const;
  absl::StatusOr<Node> FromStore(NodeId id);

  const Snapshot& snapshot_;
  const GraphView& graph_;
  LayerTable layers_;
  int node_view_;
  std::vector<NodeId> expected_ids_;
  InTurn<NodeId> expected_;
};

}  // namespace dsg::query
