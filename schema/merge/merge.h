// SPDX-License-Identifier: Apache-2.0
// Plans the merge of another map into this one: what becomes of each of its nodes. Writes nothing;
// a plan can be shown first. merge_deltas.h makes the deltas.
//
//   auto plan = *PlanMerge(*into, *other, map_T_other, {.used_ids = ...}, stop);
//   MergeDeltas deltas(into, other, std::move(plan), "author");
//   while (auto delta = *deltas.Next(stop)) writer->Commit(*delta);
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/align.h"
#include "schema/merge/match_nodes.h"
#include "schema/merge/mesh_join.h"
#include "schema/merge/session_change.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"
#include "schema/store/snapshot.h"

namespace dsg::merge {

/// The largest index that a map ever used, by letter.
using UsedIds = std::map<char, uint64_t>;

/// Looks through all readable revisions. Ids that only compacted or erased revisions had are
/// unknown.
absl::StatusOr<UsedIds> FindUsedIds(MapReader* map, const StopCheck& stop);

/// What earlier plans of one merge have committed. Others may have changed it since.
struct Written {
  /// Ids of the other map, and their ids here.
  std::map<NodeId, NodeId> nodes;
  std::set<EdgeKey> edges;
};

struct MergeOptions {
  MatchOptions match;
  ChangeOptions change;
  MeshJoinOptions mesh;
  /// Ids at the head of `into` always count as used.
  UsedIds used_ids;
  /// For the state of the maps at earlier merges. Null: only the newest revision of that map is
  /// consulted.
  MapReader* into_map = nullptr;
  MapReader* other_map = nullptr;
  /// Empty for the first plan of a merge.
  Written written;
  /// Look for changes that the session of the other map shows; see session_change.h.
  bool find_changes = true;
  /// Read the whole other map to check that it fits into this one. Not needed when planning again.
  bool check_reach = true;
  /// Approximate rows per delta.
  size_t batch_row_count = 4000;
};

struct MergeCounts {
  int64_t fused_object_count = 0;
  int64_t fused_place_count = 0;
  int64_t fused_room_count = 0;
  int64_t fused_structure_count = 0;
  /// New nodes, agents included.
  int64_t added_node_count = 0;
  int64_t gone_count = 0;
  int64_t moved_count = 0;
  /// Copies that others have changed here, so that they do not follow the other map.
  int64_t kept_count = 0;
};

struct MergePlan {
  std::string into_name;
  std::string other_name;
  Revision into_revision = 0;
  Revision other_revision = 0;
  Pose3d map_T_other;
  Evidence evidence;
  /// Every id of `other`, and its id in `into`.
  std::map<NodeId, NodeId> node_ids;
  MergeCounts counts;
  /// Root mean square distance of fused objects, metres; 0 without any.
  double residual_m = 0.0;
  /// Ids in `into`, ascending: nodes that ended, and (old, new) of those that moved.
  std::vector<NodeId> gone;
  std::vector<std::pair<NodeId, NodeId>> moved;
  /// Complete nodes and edges to write; may be empty when nothing is new.
  GraphDelta graph;
  /// Agents in `into` that earlier merges copied: the readable revisions of the other map from
  /// which they were copied (null: the present one), and the transform of the last merge.
  std::map<NodeId, std::vector<std::shared_ptr<const Snapshot>>> track_bases;
  Pose3d map_T_other_before;
  /// All copied agents, with or without such revisions.
  std::set<NodeId> copied_agents;
  /// Class and mesh instance numbers of the other map's vertices, and their numbers here.
  std::map<uint32_t, uint32_t> class_of;
  std::map<uint32_t, uint32_t> instance_of;
  MeshJoinOptions mesh;
  size_t batch_row_count = 0;
};

/// Errors: INVALID_ARGUMENT/FIELD_INVALID for a map with itself, and for a transform that is
/// invalid, tilts, or leads out of the coordinate range; FAILED_PRECONDITION/FRAMES_INCOMPATIBLE
/// when clocks or ranks of layers differ; OUT_OF_RANGE/TIME_OUTSIDE_MAP for tracks too far from the
/// epoch of `into`; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED when ids run out; those of CheckDelta for
/// nodes that `into` cannot hold; what `stop` returned.
/// Cost: both graphs in memory; reads poses and mesh of `other`.
absl::StatusOr<MergePlan> PlanMerge(const Snapshot& into, const Snapshot& other,
                                    const Pose3d& map_T_other, const MergeOptions& options,
                                    const StopCheck& stop);

/// Checks what does not depend on the transform. Errors: as PlanMerge.
absl::Status CheckMergeable(const Snapshot& into, const Snapshot& other);

}  // namespace dsg::merge
