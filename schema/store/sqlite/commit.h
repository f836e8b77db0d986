// SPDX-License-Identifier: Apache-2.0
// The state of one commit while it is being applied, and the parts that apply it.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_map>

#include "schema/codec/trajectory_codec.h"
#include "schema/model/graph_delta.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/touched_keys.h"

namespace dsg::sqlite {

/// One commit. `head` begins as a copy of the newest revision, and becomes the next one.
struct CommitContext {
  Database& db;
  const MapSpec& spec;
  RevisionRecord head;
  int64_t delta_checksum = 0;
  /// What has been touched so far.
  TouchedKeys touched = {};

  Revision revision() const { return head.info.revision; }
};

/// Writes layers, labels, nodes, edges.
class GraphRowsWriter {
 public:
  explicit GraphRowsWriter(CommitContext* commit) : commit_(*commit) {}
  absl::Status WriteLayers(const std::vector<Layer>& layers);
  absl::Status WriteLabels(const std::vector<SemanticLabel>& labels);
  absl::Status WriteNodes(const std::vector<Node>& nodes);
  absl::Status EndEdges(const std::vector<EdgeKey>& keys);
  absl::Status Retire(const Retirement& item);
  absl::Status WriteEdges(const std::vector<Edge>& edges);

 private:
  absl::Status WriteLayer(const Layer& layer);
  absl::Status WriteLabel(const SemanticLabel& label);
  absl::Status WriteNode(const Node& node);
  absl::Status InsertNode(const Node& node, const std::string& payload);
  /// Moves the current row to the history. Returns false if there is none.
  absl::StatusOr<bool> EndNode(int64_t key);
  absl::Status EndEdgesOf(int64_t key);
  absl::Status WriteEdge(const Edge& edge);
  /// False, and nothing done, if there is such an edge.
  absl::StatusOr<bool> InsertEdge(const Edge& edge, int64_t relation, const std::string& payload);
  absl::StatusOr<bool> EndEdge(int64_t source, int64_t relation, int64_t target);
  absl::StatusOr<int64_t> FindOrAddRelation(const std::string& name);

  CommitContext& commit_;
  /// Ids of the relations that this commit has met.
  std::map<std::string, int64_t> relations_;
};

/// Writes stays, mesh blocks, assets, factors and shapes.
absl::Status WriteStays(const std::vector<Stay>& stays, CommitContext* commit);
absl::Status EndStays(const std::vector<StayKey>& keys, CommitContext* commit);
absl::Status EndStaysOf(NodeId agent, CommitContext* commit);
absl::Status WriteMeshBlocks(const std::vector<MeshBlock>& blocks, CommitContext* commit);
absl::Status EndMeshBlocks(const std::vector<BlockIndex>& indices, CommitContext* commit);
absl::Status WriteAssets(const std::vector<Asset>& assets, CommitContext* commit);
absl::Status WriteFactors(const std::vector<FactorAppend>& factors, CommitContext* commit);
absl::Status WriteShapes(const std::vector<ShapeAppend>& shapes, CommitContext* commit);
absl::Status EndFactors(const TrackSpan& span, CommitContext* commit);
absl::Status EndShapes(const TrackSpan& span, CommitContext* commit);

/// One row a key and revision that began or ended a row of that key, whatever the number of rows:
/// kind (N, E, M, T, L), three numbers of its key, revision. What lists of touched keys must say.
inline constexpr char kTouchedRows[] =
    "SELECT 'N', key, 0, 0, rev_from FROM node"
    " UNION SELECT 'N', key, 0, 0, rev_from FROM node_history"
    " UNION SELECT 'N', key, 0, 0, rev_to FROM node_history"
    " UNION SELECT 'E', source, relation, target, rev_from FROM edge"
    " UNION SELECT 'E', source, relation, target, rev_from FROM edge_history"
    " UNION SELECT 'E', source, relation, target, rev_to FROM edge_history"
    " UNION SELECT 'M', x, y, z, rev_from FROM mesh_block"
    " UNION SELECT 'M', x, y, z, rev_from FROM mesh_block_history"
    " UNION SELECT 'M', x, y, z, rev_to FROM mesh_block_history"
    " UNION SELECT 'T', agent, 0, 0, revision FROM track_mark JOIN track USING (slot)"
    " UNION SELECT 'L', 0, 0, 0, rev_from FROM layer WHERE rev_from > 0"
    " UNION SELECT 'L', 0, 0, 0, rev_from FROM label";

/// Leaves the list of what the commit touched.
absl::Status InsertTouched(CommitContext* commit);

/// Id of a relation's name, 0 if the map has never seen it.
absl::StatusOr<int64_t> FindRelation(Database& db, const std::string& name);

/// Writes trajectories. Keeps the open tail of each track between commits; after a failed commit
/// it must be forgotten.
class TrackWriter {
 public:
  TrackWriter();
  ~TrackWriter();

  absl::Status Append(const TrajectoryAppend& append, CommitContext* commit);
  absl::Status Correct(const TrajectoryCorrection& correction, CommitContext* commit);
  /// The agent never existed: its poses end with this revision.
  absl::Status End(NodeId agent, CommitContext* commit);
  void Forget();

 private:
  struct Tail;
  absl::StatusOr<Tail*> LoadTail(NodeId agent, CommitContext* commit);
  absl::Status LoadOpenSegment(Tail* tail, CommitContext* commit);
  absl::Status AppendPose(const StoredPose& pose, Tail* tail, CommitContext* commit);
  absl::Status WriteSegment(Tail* tail, CommitContext* commit);
  absl::Status WriteMark(const Tail& tail, CommitContext* commit);
  absl::Status TakeSegments(TimeNs from_ns, TimeNs to_ns, Tail* tail,
                            std::vector<StoredPose>* poses, int64_t* next_id,
                            CommitContext* commit);
  absl::Status LoadSegmentBefore(int64_t next_id, Tail* tail, CommitContext* commit);
  absl::Status ExtendBox(int64_t id, const StoredPose& before, CommitContext* commit);
  absl::Status WriteBetween(std::vector<StoredPose> poses, int64_t next_id, Tail* tail,
                            CommitContext* commit);
  absl::Status FindEnds(CommitContext* commit);

  std::unordered_map<NodeId, std::unique_ptr<Tail>> tails_;
};

}  // namespace dsg::sqlite
