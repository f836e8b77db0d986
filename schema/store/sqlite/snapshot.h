// SPDX-License-Identifier: Apache-2.0
// A snapshot over SQLite. Every statement names the revision and finds its rows in the current or
// the history table, so that no lock and no long read transaction is needed.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "schema/store/sqlite/map_reader.h"

namespace dsg::sqlite {

class SqliteSnapshot : public Snapshot {
 public:
  SqliteSnapshot(std::shared_ptr<SqliteMapReader> reader,
                 std::shared_ptr<const RevisionRecord> head)
      : reader_(std::move(reader)), head_(std::move(head)) {}

  const MapSpec& spec() const override { return reader_->spec(); }
  Revision revision() const override { return head_->info.revision; }
  uint64_t opening() const override { return reader_->opening(); }
  const std::string& incarnation() const override { return reader_->incarnation(); }

  absl::StatusOr<std::vector<Layer>> Layers() const override;
  absl::StatusOr<std::vector<SemanticLabel>> Labels() const override;
  absl::StatusOr<MapStats> Stats() const override;

  absl::StatusOr<Node> GetNode(NodeId id) const override;
  absl::StatusOr<std::vector<NodeId>> NodesNamed(const std::string& name) const override;
  absl::Status ScanNodes(const NodeFilter& filter, NodeId after, const StopCheck& stop,
                         const std::function<bool(const Node&)>& visit) const override;
  absl::Status ScanEdges(const EdgeFilter& filter, const std::optional<EdgeKey>& after,
                         const StopCheck& stop,
                         const std::function<bool(const Edge&)>& visit) const override;
  absl::StatusOr<std::optional<Edge>> FindEdge(const EdgeKey& key) const override;
  absl::StatusOr<std::vector<std::optional<Node>>> FindNodes(const std::vector<NodeId>& ids,
                                                             const StopCheck& stop) const override;
  absl::StatusOr<std::vector<std::optional<Edge>>> FindEdges(const std::vector<EdgeKey>& keys,
                                                             const StopCheck& stop) const override;
  absl::Status ReadAllNodes(const StopCheck& stop,
                            const std::function<void(const Node&)>& visit) const override;
  absl::Status ReadAllEdges(const StopCheck& stop,
                            const std::function<void(const Edge&)>& visit) const override;
  absl::StatusOr<std::vector<NodeId>> Ancestors(NodeId id) const override;

  using Snapshot::Tracks;
  absl::StatusOr<std::vector<TrackInfo>> Tracks(const StopCheck& stop) const override;
  absl::StatusOr<TrackInfo> GetTrack(NodeId agent) const override;
  absl::StatusOr<LocatedPose> Locate(NodeId agent, TimeNs at_ns) const override;
  absl::Status ReadPoseRuns(
      NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
      const std::function<bool(absl::Span<const TimedPose>)>& visit) const override;
  absl::StatusOr<std::vector<BoxVisit>> VisitsToBox(const Box3d& box_map, TimeNs from_ns,
                                                    TimeNs to_ns,
                                                    const StopCheck& stop) const override;
  absl::StatusOr<int64_t> CountObservedAgents(TimeNs from_ns, TimeNs to_ns,
                                              const StopCheck& stop) const override;

  absl::StatusOr<std::optional<Stay>> StayAt(NodeId agent, TimeNs at_ns) const override;
  absl::StatusOr<std::vector<Stay>> StaysOfAgent(NodeId agent, TimeNs from_ns,
                                                 TimeNs to_ns) const override;
  absl::StatusOr<std::vector<Stay>> StaysInNode(NodeId room_or_place, TimeNs from_ns, TimeNs to_ns,
                                                const StopCheck& stop) const override;

  absl::StatusOr<std::vector<PoseFactor>> Factors(NodeId agent, TimeNs from_ns,
                                                  TimeNs to_ns) const override;
  absl::Status ReadShapes(NodeId agent, TimeNs from_ns, TimeNs to_ns, bool with_vertices,
                          const StopCheck& stop,
                          const std::function<bool(const ShownShape&)>& visit) const override;
  absl::StatusOr<std::vector<BlockIndex>> MeshBlocks() const override;
  absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> MeshBlockVersions(
      const StopCheck& stop) const override;
  absl::StatusOr<MeshBlock> ReadMeshBlock(BlockIndex index) const override;
  absl::StatusOr<Asset> ReadAsset(const Sha256& sha256) const override;
  absl::StatusOr<AssetPart> ReadAssetPart(const Sha256& sha256, int64_t index) const override;

 private:
  absl::StatusOr<std::vector<NodeId>> ChildrenOf(NodeId parent) const;
  /// Nodes whose boxes touch, at the head; nullopt when a later revision exists.
  absl::StatusOr<std::optional<std::vector<NodeId>>> IdsTouching(const Box3d& box_map) const;
  absl::StatusOr<std::optional<std::vector<NodeId>>> Candidates(const NodeFilter& filter) const;
  absl::StatusOr<std::vector<Node>> ReadBatch(const NodeFilter& filter, NodeId after) const;
  absl::StatusOr<std::vector<Edge>> EdgesAt(NodeId end, bool outgoing) const;
  absl::StatusOr<NodeId> FindParent(NodeId id) const;
  absl::StatusOr<NodeIdsPtr> AgentIds(const StopCheck& stop) const;
  /// Segments whose boxes in space and time touch, by agent; ascending ids.
  absl::StatusOr<std::map<NodeId, std::vector<int64_t>>> SegmentsTouching(const Box3d& box_map,
                                                                          TimeNs from_ns,
                                                                          TimeNs to_ns) const;
  /// Positions around [from_ns, to_ns] of a segment and, joined to it, of the pose before it.
  absl::Status PositionsAround(const Track& track, size_t segment, TimeNs from_ns, TimeNs to_ns,
                               std::vector<TimedPosition>* positions) const;

  std::shared_ptr<SqliteMapReader> reader_;
  std::shared_ptr<const RevisionRecord> head_;
};

}  // namespace dsg::sqlite
