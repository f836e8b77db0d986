// SPDX-License-Identifier: Apache-2.0
// The graph of one revision in memory, for comparison with another map, and the layers and classes
// of two maps joined by name. Poses, shapes, mesh and assets stay in the snapshot.
#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
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

/// The middle of its box; a node's own position may be a foot or a corner, and stands in without a
/// box.
Eigen::Vector3d MiddleOf(const Node& node);

/// Of a place, metres; 0 when unknown.
double ClearanceOf(const Node& node);

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

/// Above all that are used or, where those reach up to the largest number, the least that is free;
/// from 1.
template <typename Number>
Number FreeNumber(const std::set<Number>& used) {
  if (used.empty()) return 1;
  if (*used.rbegin() < std::numeric_limits<Number>::max()) {
    return std::max<Number>(0, *used.rbegin()) + 1;
  }
  Number free = 1;
  while (used.contains(free)) ++free;
  return free;
}

/// Numbers of the other map's layers and classes here, with what is new.
struct Vocabulary {
  std::map<LayerId, LayerId> layer_of;
  std::map<int32_t, int32_t> class_of;
  std::vector<Layer> new_layers;
  std::vector<SemanticLabel> new_labels;
};

/// By name. Errors: FAILED_PRECONDITION/FRAMES_INCOMPATIBLE when a layer has two ranks.
absl::StatusOr<Vocabulary> JoinVocabularies(const MapContent& into, const MapContent& other);

/// Carries the content into the frame and the numbers of the other map.
void Adopt(const Pose3d& map_T_other, const Vocabulary& vocabulary, MapContent* other);

}  // namespace dsg::merge
