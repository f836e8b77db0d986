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
  /// Edges that end with it, those of nodes before it in the plan excepted.
  int32_t edge_count = 0;
  bool may_hold_stays = false;
  bool is_agent = false;
};

struct TrackPlan {
  NodeId agent;
  /// Poses inside go. Ascending, disjoint.
  std::vector<Interval> forgotten;
  /// Times of poses that go because the others tell them. Ascending, outside of `forgotten`.
  std::vector<TimeNs> thinned_ns;
  /// Spans out of which shapes and factors go, where there are any.
  std::vector<Interval> shape_spans;
  std::vector<Interval> factor_spans;
};

struct StayEdit {
  /// As it is stored.
  StayKey key;
  /// As it is to be: without room or place, or with a later beginning.
  Stay stay;
};

struct MeshPlan {
  /// Go whole.
  std::vector<BlockIndex> removed;
  /// Lose what is in `solids`.
  std::vector<BlockIndex> cut;
  std::vector<Solid> solids;
};

struct PrunePlan {
  Revision revision = 0;
  /// One a policy, in order.
  std::vector<PolicyMatch> policies;
  /// What the policies match together, each row once.
  Amount total;
  /// Children before parents.
  std::vector<NodePlan> nodes;
  std::vector<TrackPlan> tracks;
  std::vector<StayKey> stay_removals;
  /// Stays that lose their room, their place or their beginning.
  std::vector<StayEdit> stay_edits;
  MeshPlan mesh;
  /// Of policies with kErase: what to wipe out of the past, also where nothing is left of it now.
  std::optional<Erasure> erasure;
  /// Revisions before are to be compacted; nullopt without a history policy.
  std::optional<Revision> keep_from;
  /// A policy that matches every node that is no agent, or every pose, or the branch of the map's
  /// only building; empty = none does.
  std::string all_matching_policy;
  /// The largest share, 0 to 1, of the nodes that are no agents or of the poses that goes by one
  /// policy or by all together, and by which.
  double share = 0.0;
  std::string share_policy;
  /// Agents that are ahead of what ages count back from (WorldClock). Empty without ages.
  std::vector<NodeId> implausible_agents;
  /// What ages count without, in words.
  std::vector<std::string> notes;

  /// There is nothing to commit.
  bool IsEmpty() const;
};

struct PlanOptions {
  /// What ages of revisions count back from, and what on a UNIX clock nothing was observed after;
  /// 0 = not known.
  int64_t wall_now_ns = 0;
};

/// Order:  policies count in order; where two thin one track, the later thins what the earlier
/// left. Cost:   reads all nodes and edges, the tracks and meshes that are matched; with kErase
/// also what
///         each revision changed.
/// Errors: what PrunePolicy::Validate returns; NOT_FOUND/NODE_UNKNOWN (of a policy that stands
///         alone; among others it matches nothing), LAYER_UNKNOWN; OUT_OF_RANGE/REVISION_IN_FUTURE;
///         what `stop` returned.
absl::StatusOr<PrunePlan> PlanPrune(MapReader* reader, const Snapshot& map,
                                    const std::vector<PrunePolicy>& policies,
                                    const PlanOptions& options, const StopCheck& stop);

}  // namespace dsg
