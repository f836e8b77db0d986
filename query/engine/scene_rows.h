// SPDX-License-Identifier: Apache-2.0
// Which nodes of a revision a scene (GetScene) has, and in which rows.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "query/engine/request.h"
#include "query/view/graph_view.h"
#include "schema/model/layer.h"

namespace dsg::v1 {
class GetSceneRequest;
}  // namespace dsg::v1

namespace dsg::query {

/// The rows of a scene: its nodes by layer, the highest rank first, then by id.
///
/// Threads: immutable, safe from many threads.
class SceneRows {
 public:
  struct LayerRows {
    Layer layer;
    /// Nodes that were asked for, of which those in [begin, end) of nodes() are sent.
    int64_t node_count = 0;
    size_t begin = 0;
    size_t end = 0;
  };

  static constexpr uint32_t kNoRow = UINT32_MAX;

  /// Errors: LAYER_UNKNOWN; FIELD_INVALID; of the store; what `stop` returned.
  static absl::StatusOr<SceneRows> Choose(const ReadView& view,
                                          std::shared_ptr<const GraphView> graph,
                                          const v1::GetSceneRequest& request,
                                          const StopCheck& stop);

  const GraphView& graph() const { return *graph_; }
  const std::vector<LayerRows>& layers() const { return layers_; }
  const std::vector<const ViewNode*>& nodes() const { return nodes_; }
  /// kNoRow if the node is not in the scene.
  uint32_t RowOf(NodeId id) const;
  /// map_T_node; of an agent at the instant that was asked for, nullopt in a gap of its track.
  std::optional<Pose3d> PoseOf(const ViewNode& node) const;
  /// Of everything with a place; empty without nodes.
  const Box3d& bounds_map() const { return bounds_map_; }

 private:
  absl::Status ChooseLayers(const ReadView& view, const v1::GetSceneRequest& request);
  absl::Status LocateAgents(const ReadView& view, TimeNs at_ns, const StopCheck& stop);
  bool IsWanted(const ViewNode& node) const;
  void Number();

  std::shared_ptr<const GraphView> graph_;
  std::optional<TimeNs> at_ns_;
  std::vector<LayerRows> layers_;
  std::vector<const ViewNode*> nodes_;
  absl::flat_hash_map<uint64_t, uint32_t> rows_;
  // With an instant: the agents that were there, and where.
  absl::flat_hash_map<uint64_t, std::optional<Pose3d>> agents_;
  Box3d bounds_map_;
};

}  // namespace dsg::query
