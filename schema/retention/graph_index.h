// SPDX-License-Identifier: Apache-2.0
// What policies ask of the nodes of a map at one revision, all in memory.
// Refuses to keep whole nodes: a million of them take some hundred megabytes here.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/mesh_cut.h"
#include "schema/retention/world_clock.h"
#include "schema/store/snapshot.h"

namespace dsg {

struct IndexedNode {
  NodeId id;
  LayerId layer = 0;
  bool is_agent = false;
  /// Also a pose of a track.
  bool is_pose = false;
  /// A stay may name it.
  bool may_hold_stays = false;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  TimeNs valid_to_ns = kTimeMax;
  std::optional<TimeNs> last_observed_ns;
  /// Of the payload.
  int32_t byte_count = 0;
  /// Index of what it refers to in GraphIndex::assets; -1 = none.
  int32_t asset = -1;
  /// Index of the space that a room takes in GraphIndex::solids; -1 = none.
  int32_t solid = -1;
};

/// The space that belongs to a room; nullopt for other nodes, and for rooms without an extent.
std::optional<Solid> SpaceOf(const Node& node);

class GraphIndex {
 public:
  static absl::StatusOr<GraphIndex> Load(const Snapshot& map, const StopCheck& stop);

  /// Order: ascending by id.
  const std::vector<IndexedNode>& nodes() const { return nodes_; }
  const std::vector<Sha256>& assets() const { return assets_; }
  const std::vector<Solid>& solids() const { return solids_; }
  /// Lower ranks first, then ascending ids: children before parents. Indices of nodes.
  const std::vector<uint32_t>& bottom_up() const { return bottom_up_; }
  /// By CONTAINS, as indices of nodes.
  const std::vector<uint32_t>& children(uint32_t node) const { return children_[node]; }
  const std::vector<uint32_t>& parents(uint32_t node) const { return parents_[node]; }
  /// -1 if there is no such node.
  int64_t Find(NodeId id) const;
  /// What ages count back from. Nothing until it was set.
  const WorldClock& clock() const { return clock_; }
  void SetClock(WorldClock clock) { clock_ = std::move(clock); }
  /// Order: ascending by agent.
  const std::vector<TrackInfo>& tracks() const { return tracks_; }

 private:
  absl::Status LoadNodes(const Snapshot& map, const StopCheck& stop);
  absl::Status LoadHierarchy(const Snapshot& map, const StopCheck& stop);
  absl::Status SortByRank(const Snapshot& map);
  void Add(const Node& node);

  std::vector<IndexedNode> nodes_;
  std::vector<Sha256> assets_;
  std::vector<Solid> solids_;
  std::vector<uint32_t> bottom_up_;
  std::vector<std::vector<uint32_t>> children_;
  std::vector<std::vector<uint32_t>> parents_;
  std::vector<TrackInfo> tracks_;
  WorldClock clock_;
};

}  // namespace dsg
