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

/// Clocks that are wrong by more are noticed; those that are wrong by less are believed.
inline constexpr TimeNs kClockLeapMaxNs = 7 * kNsPerDay;

/// The clock of a map's observations, as far as it can be trusted.
///
/// Now is the newest time that something else supports: another agent, or a thing that was
/// observed, at most kClockLeapMaxNs before. Where an agent's newest pose is not supported, its
/// poses before its own last leap speak for it. On a UNIX clock now is no later than the wall
/// clock, unless the map's epoch is later than that. Where nothing supports anything, now is the
/// oldest of what the agents and things say last: an age then takes too little rather than too
/// much.
///
/// An agent of which the end came into the map when others were already further by a leap has a
/// clock that is behind, or brought an old log. What it told counts as old from when the map
/// learnt it. Compacted revisions do not tell when that was; then its times count as they are.
struct WorldClock {
  /// nullopt in a map in which nothing was observed.
  std::optional<TimeNs> now_ns;
  /// Agents with times later than now by a leap. Ascending.
  std::vector<NodeId> ahead;
  /// By how much the clocks of agents were behind. Above kClockLeapMaxNs each.
  std::map<NodeId, TimeNs> lag_ns;

  /// What ages of an agent's times count back from. Requires: now_ns has a value.
  TimeNs NowOf(NodeId agent) const;
};

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

/// `wall_now_ns`: 0 = not known. `age_min_ns`: the least age that is asked for; no lag is looked
/// for of agents all of whose poses are younger. Cost:   reads tracks that are longer than a leap
/// and end in an unsupported pose; some dozen
///         lookups in the log of revisions for each other agent that was last seen longer ago than
///         a leap (2,000 of them in 2,100 revisions: 11 s).
/// Errors: what `stop` returned; NOT_FOUND and OUT_OF_RANGE when the map was compacted meanwhile.
absl::StatusOr<WorldClock> FindWorldClock(MapReader* reader, const Snapshot& map,
                                          const GraphIndex& index, TimeNs age_min_ns,
                                          int64_t wall_now_ns, const StopCheck& stop);

/// Says what ages count without; empty if all clocks agree.
std::string NoteOf(const WorldClock& clock);

}  // namespace dsg
