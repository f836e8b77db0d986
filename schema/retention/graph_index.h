// SPDX-License-Identifier: Apache-2.0
// What policies ask of a map at one revision: nodes and hierarchy, in memory (some hundred
// megabytes for a million nodes), and the time from which ages count back.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/mesh_cut.h"
#include "schema/retention/policy.h"
#include "schema/store/graph_store.h"
#include "schema/store/snapshot.h"

namespace dsg {

/// Clock errors above this are detected; smaller ones are accepted.
inline constexpr TimeNs kClockLeapMaxNs = 7 * kNsPerDay;

/// The present time of a map by its observations, robust against wrong clocks.
/// Now is the newest time that is supported by another agent, or by an observed thing, at most
/// kClockLeapMaxNs earlier. If the newest pose of an agent is not supported, its poses before its
/// last leap in time are tried. On a UNIX clock now is not later than the wall clock, unless the
/// epoch of the map is. If no time is supported, now is the oldest of the last times of agents and
/// things, so that ages remove too little rather than too much.
/// If the end of a track was committed when other tracks were later by more than a leap, the clock
/// of its agent is behind, or its log is old. Ages of its times count from the commit. If that
/// revision was compacted, its times count as they are.
struct WorldClock {
  /// nullopt in a map without observations.
  std::optional<TimeNs> now_ns;
  /// Agents with times more than a leap after now. Ascending.
  std::vector<NodeId> ahead;
  /// Delays of the clocks of agents, each above kClockLeapMaxNs.
  std::map<NodeId, TimeNs> lag_ns;

  /// The time from which ages of an agent's times count back. Requires: now_ns has a value.
  TimeNs NowOf(NodeId agent) const;
};

struct IndexedNode {
  NodeId id;
  LayerId layer = 0;
  bool is_agent = false;
  /// A pose of a track that is also kept as a node.
  bool is_pose = false;
  /// Stays may refer to it.
  bool may_hold_stays = false;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  TimeNs valid_to_ns = kTimeMax;
  std::optional<TimeNs> last_observed_ns;
  /// Size of the payload.
  int32_t byte_count = 0;
  /// Index of the space of a room in GraphIndex::solids; -1 = none.
  int32_t solid = -1;
};

/// An asset that a node refers to.
struct IndexedAsset {
  NodeId node;
  Sha256 sha256{};
};

/// The space of a room; nullopt for other nodes, and for rooms without an extent.
std::optional<Solid> SpaceOf(const Node& node);

class GraphIndex {
 public:
  static absl::StatusOr<GraphIndex> Load(const Snapshot& map, const StopCheck& stop);

  /// Order: ascending by id.
  const std::vector<IndexedNode>& nodes() const { return nodes_; }
  const std::vector<IndexedAsset>& assets() const { return assets_; }
  const std::vector<Solid>& solids() const { return solids_; }
  /// Lower ranks first, then ascending ids: children before parents. Indices of nodes.
  const std::vector<uint32_t>& bottom_up() const { return bottom_up_; }
  /// By CONTAINS, as indices of nodes.
  const std::vector<uint32_t>& children(uint32_t node) const { return children_[node]; }
  const std::vector<uint32_t>& parents(uint32_t node) const { return parents_[node]; }
  /// Index of a node; -1 if there is none.
  int64_t Find(NodeId id) const;
  /// The time from which ages count back; empty until SetClock.
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
  std::vector<IndexedAsset> assets_;
  std::vector<Solid> solids_;
  std::vector<uint32_t> bottom_up_;
  std::vector<std::vector<uint32_t>> children_;
  std::vector<std::vector<uint32_t>> parents_;
  std::vector<TrackInfo> tracks_;
  WorldClock clock_;
};

/// `age_min_ns`: the least age that policies name; agents all of whose poses are younger need no
/// lag. `wall_now_ns`: 0 = unknown.
///
/// Cost: reads tracks that are longer than a leap and end in an unsupported pose; a few dozen
/// lookups in the revision log for each other agent that was last seen longer ago than a leap
/// (2,000 agents in 2,100 revisions: 11 s).
/// Errors: what `stop` returned; NOT_FOUND and OUT_OF_RANGE when the map was compacted meanwhile.
absl::StatusOr<WorldClock> FindWorldClock(MapReader* reader, const Snapshot& map,
                                          const GraphIndex& index, TimeNs age_min_ns,
                                          int64_t wall_now_ns, const StopCheck& stop);

/// Which agents ages leave out or shift, in words; empty if all clocks agree.
std::string NoteOf(const WorldClock& clock);

}  // namespace dsg
