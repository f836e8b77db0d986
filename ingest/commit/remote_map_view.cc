// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "ingest/commit/map_view.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

class RemoteMapView : public MapView {
 public:
  explicit RemoteMapView(RemoteMap& map) : map_(map) {}

  const MapSpec& spec() const override { return map_.spec(); }

  absl::StatusOr<std::vector<Node>> NodesOfLayer(LayerId layer) const override {
    if (layer == layers::kAgents) {
      DSG_RETURN_IF_ERROR(LoadAgents());
      return agents_;
    }
    for (const Layer& known : DefaultLayers()) {
      if (known.id == layer) return map_.ListNodes(known.name);
    }
    return MakeError(Reason::kLayerUnknown, absl::StrCat("layer ", layer, " is no default layer"));
  }

  absl::StatusOr<std::vector<NodeId>> Children(NodeId parent) const override {
    return map_.ListChildren(parent);
  }

  absl::StatusOr<std::vector<Edge>> EdgesFrom(NodeId) const override { return std::vector<Edge>(); }

  // Agents only: for the rest, one round trip a node would cost more than a revision of an
  // unchanged one.
  absl::StatusOr<std::optional<Node>> FindNode(NodeId id) const override {
    DSG_RETURN_IF_ERROR(LoadAgents());
    const auto found =
        std::lower_bound(agents_.begin(), agents_.end(), id,
                         [](const Node& node, NodeId wanted) { return node.id < wanted; });
    if (found == agents_.end() || found->id != id) return std::nullopt;
    return *found;
  }
  absl::StatusOr<std::optional<Edge>> FindEdge(const EdgeKey&) const override {
    return std::nullopt;
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrack(NodeId agent) const override {
    DSG_ASSIGN_OR_RETURN(const std::optional<Node> node, FindNode(agent));
    if (!node.has_value()) return std::nullopt;
    return map_.FindTrack(agent, std::nullopt);
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrackAt(NodeId agent,
                                                       Revision revision) const override {
    if (revision == 0) return std::nullopt;
    return map_.FindTrack(agent, revision);
  }

  absl::StatusOr<std::optional<TrackInfo>> FindTrackNow(NodeId agent) const override {
    return map_.FindTrack(agent, std::nullopt);
  }

  absl::StatusOr<std::set<NodeId>> AgentsNow() const override {
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> nodes, map_.ListAgents());
    std::set<NodeId> agents;
    for (const Node& node : nodes) agents.insert(node.id);
    return agents;
  }

  absl::StatusOr<std::vector<TimedPose>> ReadPoses(NodeId agent, TimeNs from_ns,
                                                   TimeNs to_ns) const override {
    return map_.ReadPoses(agent, from_ns, to_ns);
  }

  absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before,
                                                          int limit) const override {
    return map_.ListRevisions(before, limit);
  }

  // The services tell where an agent was, not the key of the stay.
  absl::StatusOr<std::optional<Stay>> StayAt(NodeId, TimeNs) const override { return std::nullopt; }

 private:
  absl::Status LoadAgents() const {
    if (is_loaded_) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(agents_, map_.ListAgents());
    is_loaded_ = true;
    return absl::OkStatus();
  }

  RemoteMap& map_;
  mutable bool is_loaded_ = false;
  /// As the map had them when first asked; ascending by id, as the service lists them.
  mutable std::vector<Node> agents_;
};

}  // namespace

std::unique_ptr<MapView> MakeRemoteMapView(RemoteMap& map) {
  return std::make_unique<RemoteMapView>(map);
}

}  // namespace dsg::ingest
