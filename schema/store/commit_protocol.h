// SPDX-License-Identifier: Apache-2.0
// What every commit goes through, whatever the backend: a delta that comes twice is answered as the
// first time, a missing or stale one is refused, patches become whole, the invariants are proven,
// and its parts are applied in one order.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/model/delta_check.h"
#include "schema/store/graph_writer.h"

namespace dsg {

/// Poses lie no further from the epoch of their map, before or after it: 68 years. What lies beyond
/// is a wrong clock, and sums of such times need not fit 64 bits.
inline constexpr int64_t kFromEpochYearsMax = 68;

/// Errors: OUT_OF_RANGE/TIME_OUTSIDE_MAP.
absl::Status CheckTimeInMap(TimeNs time_ns, const MapSpec& spec);

/// What a delta is known by. `checksum` is its DeltaChecksum.
struct DeltaIdentity {
  std::string session_id;
  int64_t sequence = 0;
  int64_t checksum = 0;
};
DeltaIdentity IdentityOfDelta(const GraphDelta& delta);

/// What a map knows of a committed delta.
struct CommittedDelta {
  /// The one that it made or, if that is compacted away, the last one of its session.
  Revision revision = 0;
  /// Unknown in what an erasure or an older format left, and of a delta whose revision is compacted
  /// away, unless it was the last of its session.
  std::optional<int64_t> checksum;
};

/// The head of a map, as the protocol asks for it.
class CommitSource : public GraphLookup {
 public:
  virtual const MapSpec& spec() const = 0;
  virtual absl::StatusOr<SessionState> ReadSession(const std::string& session_id) const = 0;
  /// nullopt if the delta is new.
  virtual absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(const std::string& session_id,
                                                                      int64_t sequence) const = 0;
  /// Whole; nullopt when it is not believed in at the head.
  virtual absl::StatusOr<std::optional<Node>> ReadNode(NodeId id) const = 0;
  virtual absl::StatusOr<std::optional<Edge>> ReadEdge(const EdgeKey& key) const = 0;
  virtual absl::StatusOr<std::vector<Layer>> ReadLayers() const = 0;
};

/// A delta that says that it forgets must bring nothing new.
/// Errors: INVALID_ARGUMENT/DELTA_INVALID.
absl::Status CheckForgetting(const GraphDelta& delta);

/// The answer to a delta that was committed before; nullopt if it is new. One of which no checksum
/// is known is believed.
/// Errors: ALREADY_EXISTS/SEQUENCE_REUSED when another delta was committed under the name.
absl::StatusOr<std::optional<CommitResult>> FindReplay(const CommitSource& source,
                                                       const DeltaIdentity& delta);

/// All that comes before a row is written. Makes the delta whole (patches become nodes and edges)
/// and coalesces it. Returns the answer if the delta was committed before.
/// Errors: those of GraphWriter::Commit that leave nothing written.
absl::StatusOr<std::optional<CommitResult>> PrepareCommit(const CommitSource& source,
                                                          const DeltaIdentity& identity,
                                                          Revision head, GraphDelta* delta);

/// Applies a delta part by part, in the order on which digests and rules depend: assets before who
/// refers to them, what never existed ends before it may come again, nodes before their edges,
/// corrections before appends, removals before what replaces them. `parts` is a backend's:
/// WriteAssets, EndAgent (all of an agent but its node), WriteLayers, WriteLabels, WriteNodes,
/// EndEdges, Retire, WriteEdges, Correct, Append, EndFactors, WriteFactors, EndShapes, WriteShapes,
/// EndStays, WriteStays, EndMeshBlocks, WriteMeshBlocks.
template <typename Parts>
absl::Status ApplyInOrder(const GraphDelta& delta, Parts* parts) {
  DSG_RETURN_IF_ERROR(parts->WriteAssets(delta.assets));
  for (const Retirement& item : delta.retirements) {
    if (!item.valid_to_ns.has_value()) DSG_RETURN_IF_ERROR(parts->EndAgent(item.id));
  }
  DSG_RETURN_IF_ERROR(parts->WriteLayers(delta.layers));
  DSG_RETURN_IF_ERROR(parts->WriteLabels(delta.labels));
  DSG_RETURN_IF_ERROR(parts->WriteNodes(delta.nodes));
  DSG_RETURN_IF_ERROR(parts->EndEdges(delta.edge_removals));
  for (const Retirement& item : delta.retirements) DSG_RETURN_IF_ERROR(parts->Retire(item));
  DSG_RETURN_IF_ERROR(parts->WriteEdges(delta.edges));
  for (const TrajectoryCorrection& item : delta.corrections) {
    DSG_RETURN_IF_ERROR(parts->Correct(item));
  }
  for (const TrajectoryAppend& item : delta.appends) DSG_RETURN_IF_ERROR(parts->Append(item));
  for (const TrackSpan& span : delta.factor_removals) {
    DSG_RETURN_IF_ERROR(parts->EndFactors(span));
  }
  DSG_RETURN_IF_ERROR(parts->WriteFactors(delta.factors));
  for (const TrackSpan& span : delta.shape_removals) DSG_RETURN_IF_ERROR(parts->EndShapes(span));
  DSG_RETURN_IF_ERROR(parts->WriteShapes(delta.shapes));
  DSG_RETURN_IF_ERROR(parts->EndStays(delta.stay_removals));
  DSG_RETURN_IF_ERROR(parts->WriteStays(delta.stays));
  DSG_RETURN_IF_ERROR(parts->EndMeshBlocks(delta.mesh_removals));
  return parts->WriteMeshBlocks(delta.mesh_blocks);
}

}  // namespace dsg
