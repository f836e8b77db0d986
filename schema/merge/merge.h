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

/// By letter: the largest index that a map ever used.
using UsedIds = std::map<char, uint64_t>;

/// Looks through all readable revisions. Ids that only revisions compacted or erased away have
/// shown are known to nobody.
absl::StatusOr<UsedIds> FindUsedIds(MapReader* map, const StopCheck& stop);

/// What earlier plans of one merge have committed. What became of it since is for others to say.
struct Written {
  /// Nodes of the other map, and what they are here.
  std::map<NodeId, NodeId> nodes;
  std::set<EdgeKey> edges;
};

struct MergeOptions {
  MatchOptions match;
  ChangeOptions change;
  MeshJoinOptions mesh;
  /// What is believed at the head of `into` counts as used in any case.
  UsedIds used_ids;
  /// To look up what maps were when they were merged before. Where one is null, only the newest
  /// revision of that map tells.
  MapReader* into_map = nullptr;
  MapReader* other_map = nullptr;
  /// Empty for the first plan of a merge.
  Written written;
  /// Look for what the other map's session contradicts; see session_change.h.
  bool find_changes = true;
  /// Read the whole other map to see that all of it fits into this one; a plan that is made anew
  /// need not.
  bool check_reach = true;
  /// Rows of one delta, about.
  size_t batch_row_count = 4000;
};

struct MergeCounts {
  int64_t fused_object_count = 0;
  int64_t fused_place_count = 0;
  int64_t fused_room_count = 0;
  int64_t fused_structure_count = 0;
  /// Nodes that are new, agents too.
  int64_t added_node_count = 0;
  int64_t gone_count = 0;
  int64_t moved_count = 0;
  /// Copies that others have changed here, and that do not follow the other map therefore.
  int64_t kept_count = 0;
};

struct MergePlan {
  std::string into_name;
  std::string other_name;
  Revision into_revision = 0;
  Revision other_revision = 0;
  Pose3d map_T_other;
  Evidence evidence;
  /// Every node of `other`, and what it is in `into`.
  std::map<NodeId, NodeId> node_ids;
  MergeCounts counts;
  /// Root mean square distance of objects fused, metres; 0 without any.
  double residual_m = 0.0;
  /// Ids in `into`, ascending: closed, and where they went: (old, new).
  std::vector<NodeId> gone;
  std::vector<std::pair<NodeId, NodeId>> moved;
  /// Nodes and edges to write, whole; may be empty when nothing is new.
  GraphDelta graph;
  /// Agents in `into` that were copied whole by earlier merges: the other map as it was then, as
  /// far as it can be read (null: as it is now), and where it was put.
  std::map<NodeId, std::vector<std::shared_ptr<const Snapshot>>> track_bases;
  Pose3d map_T_other_before;
  /// All of them, with or without such a past.
  std::set<NodeId> copied_agents;
  /// Class and mesh instance of the other map's vertices, here.
  std::map<uint32_t, uint32_t> class_of;
  std::map<uint32_t, uint32_t> instance_of;
  MeshJoinOptions mesh;
  size_t batch_row_count = 0;
};

/// Errors: INVALID_ARGUMENT/FIELD_INVALID for a map with itself, or a transform that is none, tilts
/// or leads beyond the coordinates of a map; FAILED_PRECONDITION/FRAMES_INCOMPATIBLE when clocks
/// differ or a layer has another rank; OUT_OF_RANGE/TIME_OUTSIDE_MAP for tracks too far from the
/// epoch of `into`; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED when ids have come to their end; as
/// CheckDelta for nodes that it could not hold; what `stop` returned. Cost: both graphs in memory;
/// reads poses and mesh of `other`.
absl::StatusOr<MergePlan> PlanMerge(const Snapshot& into, const Snapshot& other,
                                    const Pose3d& map_T_other, const MergeOptions& options,
                                    const StopCheck& stop);

/// What makes maps impossible to merge, whatever the transform.
/// Errors: as PlanMerge.
absl::Status CheckMergeable(const Snapshot& into, const Snapshot& other);

}  // namespace dsg::merge
