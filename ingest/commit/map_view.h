// SPDX-License-Identifier: Apache-2.0
// What ingest reads of a map before it writes: the same questions to a local store or a server.
// Refuses everything else, so that a log's deltas depend on no more of the map than this.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/remote_writer.h"
#include "schema/store/graph_store.h"
#include "schema/store/snapshot.h"

namespace dsg::ingest {

/// The map when a log begins.
class MapView {
 public:
  virtual ~MapView() = default;

  virtual const MapSpec& spec() const = 0;
  /// All nodes of a layer. Order: ascending id.
  virtual absl::StatusOr<std::vector<Node>> NodesOfLayer(LayerId layer) const = 0;
  /// Targets of CONTAINS edges from `parent`. Order: ascending id.
  virtual absl::StatusOr<std::vector<NodeId>> Children(NodeId parent) const = 0;

  /// Edges from `source`, of any relation; none when asking costs a round trip a node.
  virtual absl::StatusOr<std::vector<Edge>> EdgesFrom(NodeId source) const = 0;

  /// nullopt when the map has no such node, or when asking costs a round trip a node.
  virtual absl::StatusOr<std::optional<Node>> FindNode(NodeId id) const = 0;
  /// As FindNode.
  virtual absl::StatusOr<std::optional<Edge>> FindEdge(const EdgeKey& key) const = 0;

  /// nullopt for an unknown agent, and for one without poses.
  virtual absl::StatusOr<std::optional<TrackInfo>> FindTrack(NodeId agent) const = 0;
  /// As FindTrack, as believed at a revision; 0 = before the first.
  virtual absl::StatusOr<std::optional<TrackInfo>> FindTrackAt(NodeId agent,
                                                               Revision revision) const = 0;
  /// Stored poses with from_ns <= time < to_ns, ascending.
  virtual absl::StatusOr<std::vector<TimedPose>> ReadPoses(NodeId agent, TimeNs from_ns,
                                                           TimeNs to_ns) const = 0;
  /// As FindTrack, but of the map as it is by now.
  virtual absl::StatusOr<std::optional<TrackInfo>> FindTrackNow(NodeId agent) const = 0;
  /// Agents of the map as it is by now.
  virtual absl::StatusOr<std::set<NodeId>> AgentsNow() const = 0;
  /// Revisions of the map as it is by now, newest first, below `before` (0 = from the newest), at
  /// most `limit`.
  virtual absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before,
                                                                  int limit) const = 0;
  /// The stored stay that holds an instant; nullopt also when the map cannot be asked for it.
  virtual absl::StatusOr<std::optional<Stay>> StayAt(NodeId agent, TimeNs at_ns) const = 0;
};

/// Requires: `map` is the map of the snapshot.
std::unique_ptr<MapView> MakeSnapshotMapView(std::shared_ptr<const Snapshot> snapshot,
                                             std::shared_ptr<MapReader> map);

/// Requires: `map` outlives the view.
std::unique_ptr<MapView> MakeRemoteMapView(RemoteMap& map);

}  // namespace dsg::ingest
