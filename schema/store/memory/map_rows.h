// SPDX-License-Identifier: Apache-2.0
// All that a map in memory consists of: the rows with their lifetimes, the records of its
// revisions, and what it remembers besides.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "schema/codec/trajectory_codec.h"
#include "schema/store/commit_protocol.h"
#include "schema/store/erase_list.h"
#include "schema/store/graph_store.h"
#include "schema/store/memory/versions.h"
#include "schema/store/readable.h"
#include "schema/store/revision_record.h"

namespace dsg::memory {

/// As its payload says, so that what is read is what any backend reads.
struct StoredNode {
  Node node;
  std::string payload;
};
struct StoredEdge {
  Edge edge;
  int64_t relation = 0;
  std::string payload;
};
/// Factors or shapes; see track_rules.h.
struct StoredBatch {
  NodeId agent;
  TimeNs t0 = 0;
  TimeNs t1 = 0;
  std::string payload;
};
struct StoredAsset {
  Revision from = 0;
  std::string media_type;
  std::string content;
};

/// The poses of one agent, by time.
using Track = Versions<TimeNs, StoredPose>;
/// By the order in which they were written.
using Batches = Versions<int64_t, StoredBatch>;

/// One commit.
struct Commit {
  RevisionRecord record;
  /// Digest of the revision before, which may be compacted away.
  Sha256 parent{};
  /// Unknown once something was erased.
  std::optional<int64_t> delta_checksum;
  /// Since the record before; unset in the first one that is left of a compacted map.
  std::optional<TouchedKeys> touched;
};

struct Session {
  SessionState state;
  std::optional<int64_t> last_checksum;
};

struct NotedErasure {
  Revision planned_at = 0;
  EraseList list;
};

/// What changes with commits and forgetting.
struct MapContent {
  /// Ascending by the revision that brought them.
  std::vector<std::pair<Revision, Layer>> layers;
  std::vector<std::pair<Revision, SemanticLabel>> labels;
  /// Numbers of relations, from 1; see EdgeRow.
  std::map<std::string, int64_t> relations;
  Versions<NodeId, StoredNode> nodes;
  Versions<EdgeKey, StoredEdge> edges;
  Versions<StayKey, Stay> stays;
  /// Encoded.
  Versions<BlockIndex, std::string> mesh_blocks;
  /// Of agents that ever had poses.
  std::map<NodeId, Track> tracks;
  Batches factors;
  Batches shapes;
  int64_t last_batch = 0;
  std::map<Sha256, StoredAsset> assets;
  /// By compaction; they go on counting in digests.
  std::set<std::pair<Revision, Sha256>> dropped_assets;

  std::map<Revision, Commit> commits;
  std::map<std::string, Session> sessions;
  std::map<std::string, Tag> tags;
  Revision oldest = 0;
  /// Counts how often the past was rewritten.
  int64_t generation = 0;

  bool is_erasing = false;
  EraseList pending_erasure;
  std::vector<NotedErasure> noted_erasures;

  /// Who writes the map; empty when nobody does.
  std::string writer;
};

/// Threads: whoever reads or writes holds `mutex`, except for `spec` and `incarnation`, which never
/// change.
struct MapRows : MapContent {
  explicit MapRows(MapSpec map_spec);
  /// A map that has been another one, such as under another name.
  MapRows(MapSpec map_spec, std::string incarnation_kept, MapContent content);

  const MapSpec spec;
  const std::string incarnation;
  mutable std::mutex mutex;

  /// Revision 0 of an empty map.
  RevisionRecord Head() const;
  Revision newest() const { return Head().info.revision; }
  Readable ReadableNow() const;
  absl::StatusOr<int64_t> FindRelation(const std::string& name) const;

  std::optional<Node> NodeAt(NodeId id, Revision revision) const;
  std::vector<Layer> LayersAt(Revision revision) const;
  /// First and last pose that a revision shows; nullopt without poses.
  static std::optional<Interval> SpanOf(const Track& track, Revision revision);
  std::optional<Interval> SpanOfAll(Revision revision) const;
  /// nullopt when no such agent is there.
  std::optional<TrackInfo> TrackInfoAt(NodeId agent, Revision revision) const;
  PendingErasure CountPending() const;

  /// What the rows add to the records at each revision, from the rows alone.
  std::map<Revision, RowSums> SumChanges() const;
};

/// Rows as digests know them.
NodeRow RowOf(const Versions<NodeId, StoredNode>::Version& version);
EdgeRow RowOf(const Versions<EdgeKey, StoredEdge>::Version& version);
StayRow RowOf(const Versions<StayKey, Stay>::Version& version);
MeshRow RowOf(const BlockIndex& index, const Versions<BlockIndex, std::string>::Version& version);
template <typename Row>
Row BatchRowOf(const Batches::Version& version) {
  const StoredBatch& batch = version.value;
  return {{batch.agent, version.from, batch.t0, batch.t1, batch.payload}};
}

}  // namespace dsg::memory
