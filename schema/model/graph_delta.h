// SPDX-License-Identifier: Apache-2.0
// The only way into a store: one change of one map, applied whole or not at all.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg {

struct TrajectoryAppend {
  NodeId agent;
  /// Strictly growing in time, later than all that is stored for the agent.
  std::vector<TimedPose> poses;
};

/// Replaces what is believed of the agent over [from_ns, to_ns) by `poses`.
struct TrajectoryCorrection {
  NodeId agent;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  std::vector<TimedPose> poses;
};

struct FactorAppend {
  NodeId agent;
  std::vector<PoseFactor> factors;
};

/// A shape of a time that is stored already replaces the older one from this revision on.
struct ShapeAppend {
  NodeId agent;
  /// The asset with the faces between the vertices (schema/codec/topology.h).
  std::optional<Sha256> topology;
  /// Strictly growing in time.
  std::vector<BodyShape> shapes;
};

struct Retirement {
  NodeId id;
  /// The instant it left the world; unset: it never existed, and its row ends here.
  std::optional<TimeNs> valid_to_ns;
};

/// Changes some fields of a node, or makes it; the others stay as they are stored. See
/// schema/codec/patch.h.
struct NodePatch {
  NodeId id;
  /// A dsg.v1.Node, serialized.
  std::string fields;
  /// Paths of dsg.v1.Node: what is written, also where `fields` does not set it. Empty = what
  /// `fields` sets.
  std::vector<std::string> mask;
};

struct EdgePatch {
  EdgeKey key;
  /// A dsg.v1.Edge, serialized.
  std::string fields;
  std::vector<std::string> mask;
};

/// A stretch of one agent's life, half-open.
struct TrackSpan {
  NodeId agent;
  TimeNs from_ns = kTimeMin;
  TimeNs to_ns = kTimeMax;
};

struct StayKey {
  NodeId agent;
  TimeNs enter_ns = 0;
  auto operator<=>(const StayKey&) const = default;
};

/// The identity of a delta is (session_id, sequence): committing it again changes nothing, and
/// another delta of that name is refused.
struct GraphDelta {
  std::string map;
  std::string session_id;
  /// From 1, without gaps in a session.
  int64_t sequence = 0;
  /// If set, the commit fails unless this is still the newest revision.
  std::optional<Revision> parent_revision;
  std::string author;
  std::string message;
  std::string config_digest;

  std::vector<Layer> layers;
  std::vector<SemanticLabel> labels;
  std::vector<Node> nodes;
  /// Go after `nodes`, in order; edge patches after `edges`.
  std::vector<NodePatch> node_patches;
  std::vector<EdgePatch> edge_patches;
  std::vector<Retirement> retirements;
  std::vector<Edge> edges;
  std::vector<EdgeKey> edge_removals;
  std::vector<TrajectoryAppend> appends;
  std::vector<TrajectoryCorrection> corrections;
  /// Factors of the agent of which an end lies in the span are no longer believed. Go before
  /// `factors`.
  std::vector<TrackSpan> factor_removals;
  std::vector<FactorAppend> factors;
  /// Body shapes with from_ns <= time < to_ns are no longer believed. Go before `shapes`.
  std::vector<TrackSpan> shape_removals;
  std::vector<ShapeAppend> shapes;
  /// Go before `stays`; one that is not there is no error.
  std::vector<StayKey> stay_removals;
  std::vector<Stay> stays;
  std::vector<MeshBlock> mesh_blocks;
  std::vector<BlockIndex> mesh_removals;
  std::vector<Asset> assets;

  /// May use the space that is kept for forgetting when the disk or the quota of the map is full.
  /// Such a delta brings nothing new: it holds retirements, removals, corrections, stays and mesh
  /// blocks only. Says how to commit, and is not stored.
  bool is_forgetting = false;

  /// Nothing to write besides the revision itself.
  bool empty() const;
};

/// Grows the boxes of parents so that each holds its children's, bottom up along the delta's
/// CONTAINS edges. Nodes that the delta does not hold are left alone.
void FitBoxesToChildren(GraphDelta* delta);

/// Sorts every part by key and keeps the last of entries with equal keys, so that an entity is
/// written once per revision; merges appends to one agent. An edge both upserted and removed is
/// removed. Deltas that say the same become byte-equal.
void Coalesce(GraphDelta* delta);

/// Cuts a large delta into ones of at most `item_count_max` rows (poses and shapes count one each),
/// parents before children and nodes before their edges, so that each is valid when applied in
/// order. Session and message are copied; sequences count from `delta.sequence`.
std::vector<GraphDelta> SplitDelta(GraphDelta delta, size_t item_count_max);

/// Takes a part; `done` is the share of the rows that are in this part and those before, 0 to 1.
using TakePart = std::function<absl::Status(GraphDelta part, double done)>;

/// The parts of SplitDelta, in their order, each made when it is its turn: of an import of a
/// hundred thousand nodes only one part is in memory beside the rest of the delta. Errors: the
/// first one of `take`, which ends the walk.
absl::Status ForEachPart(GraphDelta delta, size_t item_count_max, const TakePart& take);

}  // namespace dsg
