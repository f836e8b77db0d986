// SPDX-License-Identifier: Apache-2.0
// What a set of policies would remove from a map at one revision, and how much that is. Changes
// nothing; batches.h makes the deltas.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/amount.h"
#include "schema/retention/mesh_cut.h"
#include "schema/retention/policy.h"
#include "schema/store/graph_store.h"

namespace dsg {

struct PolicyMatch {
  std::string name;
  Amount matched;
};

struct NodePlan {
  NodeId id;
  /// Edges that end with it, except those of earlier nodes of the plan.
  int32_t edge_count = 0;
  bool may_hold_stays = false;
  bool is_agent = false;
};

struct TrackPlan {
  NodeId agent;
  /// Spans of poses to remove. Ascending, disjoint.
  std::vector<Interval> forgotten;
  /// Times of poses to drop because interpolation restores them. Ascending, outside `forgotten`.
  std::vector<TimeNs> thinned_ns;
  /// Spans of shapes and factors to remove; empty without any.
  std::vector<Interval> shape_spans;
  std::vector<Interval> factor_spans;
};

struct StayEdit {
  /// The key as stored.
  StayKey key;
  /// The new stay: without room or place, or with a later beginning.
  Stay stay;
};

struct MeshPlan {
  /// Blocks to remove.
  std::vector<BlockIndex> removed;
  /// Blocks that lose what is in `solids`.
  std::vector<BlockIndex> cut;
  std::vector<Solid> solids;
};

struct PrunePlan {
  Revision revision = 0;
  /// One per policy, in order.
  std::vector<PolicyMatch> policies;
  /// What all policies match together; each row counts once.
  Amount total;
  /// Children before parents.
  std::vector<NodePlan> nodes;
  std::vector<TrackPlan> tracks;
  std::vector<StayKey> stay_removals;
  /// Stays that lose their room, their place or their beginning.
  std::vector<StayEdit> stay_edits;
  MeshPlan mesh;
  /// For policies with kErase: what to erase from all revisions, even if nothing of it is left now.
  std::optional<Erasure> erasure;
  /// Revisions before this one are compacted; nullopt without a history policy.
  std::optional<Revision> keep_from;
  /// A policy that matches all nodes other than agents, all poses, or the branch of the only
  /// building; empty = none.
  std::string all_matching_policy;
  /// The largest share (0 to 1) of the nodes other than agents, or of the poses, that one policy or
  /// all together remove, and the name of that policy.
  double share = 0.0;
  std::string share_policy;
  /// Agents that are ahead of the time from which ages count back (WorldClock). Empty without ages.
  std::vector<NodeId> implausible_agents;
  /// What ages leave out, in words.
  std::vector<std::string> notes;

  /// Whether there is nothing to commit.
  bool IsEmpty() const;
};

struct PlanOptions {
  /// The wall clock: ages of revisions count back from it, and on a UNIX clock no observation is
  /// later. 0 = unknown.
  int64_t wall_now_ns = 0;
};

/// Applies the policies in order: where two thin one track, the later one thins what the earlier
/// one left.
///
/// Errors: those of PrunePolicy::Validate; NOT_FOUND/NODE_UNKNOWN if the only policy names an
/// unknown node (among several policies such a one matches nothing), LAYER_UNKNOWN;
/// OUT_OF_RANGE/REVISION_IN_FUTURE; what `stop` returned.
/// Cost: reads all nodes and edges, and the matched tracks and meshes; with kErase also what each
/// revision changed.
absl::StatusOr<PrunePlan> PlanPrune(MapReader* reader, const Snapshot& map,
                                    const std::vector<PrunePolicy>& policies,
                                    const PlanOptions& options, const StopCheck& stop);

}  // namespace dsg
