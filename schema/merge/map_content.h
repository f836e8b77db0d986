// SPDX-License-Identifier: Apache-2.0
// The graph of one revision as plain values, to be compared with that of another map.
// Refuses what is large: poses, shapes, mesh and assets stay in the snapshot.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/snapshot.h"

namespace dsg::merge {

/// What a node is to a merge.
enum class NodeClass { kObject, kPlace, kStructure, kAgent, kRegion };

/// The class by name, or "#7" where a map numbers classes without naming them; empty = could be
/// anything.
std::string ClassKey(const Node& node);

struct MapContent {
  MapSpec spec;
  Revision revision = 0;
  std::vector<Layer> layers;
  std::vector<SemanticLabel> labels;
  /// Ascending by id.
  std::vector<Node> nodes;
  /// Ascending by key.
  std::vector<Edge> edges;
  /// Ascending by agent.
  std::vector<TrackInfo> tracks;

  // Below: derived by Index().
  std::unordered_map<NodeId, int> index_of;
  /// By node: its parent by CONTAINS with the lowest id; -1 without.
  std::vector<int> parent;
  std::unordered_map<LayerId, int32_t> rank_of;
  /// From the first to the last time that anything was observed, the end exclusive.
  std::optional<Interval> observed;

  void Index();
  /// -1 if there is none.
  int IndexOf(NodeId id) const;
  NodeClass ClassOf(int node) const;
  /// Indices, ascending.
  std::vector<int> OfClass(NodeClass node_class) const;
};

/// Cost: all nodes and edges are kept in memory.
/// Errors: as Snapshot's; what `stop` returned.
absl::StatusOr<MapContent> ReadContent(const Snapshot& snapshot, const StopCheck& stop);

}  // namespace dsg::merge
