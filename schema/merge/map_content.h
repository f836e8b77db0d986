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

/// The role of a node in a merge.
enum class NodeClass { kObject, kPlace, kStructure, kAgent, kRegion };

/// The class name, or "#7" where a map numbers classes without names; empty = unknown.
std::string ClassKey(const Node& node);

/// The centre of the node's box, map frame; the node's position, which may be a corner, without a
/// box.
Eigen::Vector3d MiddleOf(const Node& node);

/// Clearance of a place, metres; 0 when unknown.
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
  /// From the first to the last observation of anything; the end is exclusive.
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

/// A number above all used ones, or the lowest free one where the largest is used; from 1.
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

/// Layers and classes of the other map by their numbers here, and those that are new here.
struct Vocabulary {
  std::map<LayerId, LayerId> layer_of;
  std::map<int32_t, int32_t> class_of;
  std::vector<Layer> new_layers;
  std::vector<SemanticLabel> new_labels;
};

/// Joins by name. Errors: FAILED_PRECONDITION/FRAMES_INCOMPATIBLE when a layer has two ranks.
absl::StatusOr<Vocabulary> JoinVocabularies(const MapContent& into, const MapContent& other);

/// Transforms `other` into the frame of this map, and renumbers its layers and classes.
void Adopt(const Pose3d& map_T_other, const Vocabulary& vocabulary, MapContent* other);

}  // namespace dsg::merge
