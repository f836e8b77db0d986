// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/map_view.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

class SnapshotMapView : public MapView {
 public:
  SnapshotMapView(std::shared_ptr<const Snapshot> snapshot, std::shared_ptr<MapReader> map)
      : snapshot_(std::move(snapshot)), map_(std::move(map)) {}

  const MapSpec& spec() const override { return snapshot_->spec(); }

  absl::StatusOr<std::vector<Node>> NodesOfLayer(LayerId layer) const override {
    std::vector<Node> nodes;
    NodeFilter filter;
    filter.layer = layer;
    DSG_RETURN_IF_ERROR(snapshot_->ScanNodes(filter, NodeId(), {}, [&nodes](const Node& node) {
      nodes.push_back(node);
      return true;
    }));
    return nodes;
  }

  absl::StatusOr<std::vector<NodeId>> Children(NodeId parent) const override {
    std::vector<NodeId> children;
    const EdgeFilter filter{
        .source = parent, .relation = relations::kContains, .target = {}, .at_ns = {}};
    DSG_RETURN_IF_ERROR(
        snapshot_->ScanEdges(filter, std::nullopt, {}, [&children](const Edge& edge) {
          children.push_back(edge.target);
          return true;
        }));
    return children;
  }

  absl::StatusOr<std::vector<Edge>> EdgesFrom(NodeId source) const override {
    std::vector<Edge> edges;
    const EdgeFilter filter{.source = source, .relation = {}, .target = {}, .at_ns = {}};
    DSG_RETURN_IF_ERROR(snapshot_->ScanEdges(filter, std::nullopt, {}, [&edges](const Edge& edge) {
      edges.push_back(edge);
      return true;
    }));
    return edges;
  }

  absl::StatusOr<std::optional<Node>> FindNode(NodeId id) const override {
    absl::StatusOr<Node> node = snapshot_->GetNode(id);
    if (ReasonOf(node.status()) == Reason::kNodeUnknown) return std::nullopt;
    if (!node.ok()) return node.status();
    return *std::move(node);
  }

  absl::StatusOr<std::optional<Edge>> FindEdge(const EdgeKey& key) const override {
    std::optional<Edge> found;
    const EdgeFilter filter{
        .source = key.source, .relation = key.relation, .target = key.target, .at_ns = {}};
    DSG_RETURN_IF_ERROR(snapshot_->ScanEdges(filter, std::nullopt, {}, [&found](const Edge& edge) {
      found = edge;
      return false;
    }));
    return found;
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrack(NodeId agent) const override {
    return TrackIn(*snapshot_, agent);
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrackAt(NodeId agent,
                                                       Revision revision) const override {
    if (revision == 0) return std::nullopt;
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> then, map_->At(revision));
    return TrackIn(*then, agent);
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrackNow(NodeId agent) const override {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> now, map_->Latest());
    return TrackIn(*now, agent);
  }

  absl::StatusOr<std::set<NodeId>> AgentsNow() const override {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> now, map_->Latest());
    std::set<NodeId> agents;
    NodeFilter filter;
    filter.layer = layers::kAgents;
    DSG_RETURN_IF_ERROR(now->ScanNodes(filter, NodeId(), {}, [&agents](const Node& node) {
      agents.insert(node.id);
      return true;
    }));
    return agents;
  }

  absl::StatusOr<std::vector<TimedPose>> ReadPoses(NodeId agent, TimeNs from_ns,
                                                   TimeNs to_ns) const override {
    std::vector<TimedPose> poses;
    DSG_RETURN_IF_ERROR(
        snapshot_->ReadPoses(agent, from_ns, to_ns, {}, [&poses](const TimedPose& pose) {
          poses.push_back(pose);
          return true;
        }));
    return poses;
  }

  absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before,
                                                          int limit) const override {
    return map_->ListRevisions(before, limit);
  }

  absl::StatusOr<std::optional<Stay>> StayAt(NodeId agent, TimeNs at_ns) const override {
    return snapshot_->StayAt(agent, at_ns);
  }

 private:
  static absl::StatusOr<std::optional<TrackInfo>> TrackIn(const Snapshot& snapshot, NodeId agent) {
    const absl::StatusOr<TrackInfo> track = snapshot.GetTrack(agent);
    if (ReasonOf(track.status()) == Reason::kAgentUnknown) return std::nullopt;
    if (!track.ok()) return track.status();
    if (track->pose_count == 0) return std::nullopt;
    return *track;
  }

  std::shared_ptr<const Snapshot> snapshot_;
  std::shared_ptr<MapReader> map_;
};

}  // namespace

std::unique_ptr<MapView> MakeSnapshotMapView(std::shared_ptr<const Snapshot> snapshot,
                                             std::shared_ptr<MapReader> map) {
  return std::make_unique<SnapshotMapView>(std::move(snapshot), std::move(map));
}

}  // namespace dsg::ingest
