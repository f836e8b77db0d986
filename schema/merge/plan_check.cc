// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/plan_check.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/merge/transform_node.h"
#include "schema/model/delta_check.h"
#include "schema/store/commit_protocol.h"

namespace dsg::merge {
namespace {

absl::Status CheckPoint(const Eigen::Vector3d& at, const std::string& what) {
  if (at.allFinite() && at.cwiseAbs().maxCoeff() <= kCoordinateMaxM) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrFormat("the transform between the maps carries %s to (%.1f, %.1f, "
                                   "%.1f) m; coordinates of a map end at %.0f m, so check its "
                                   "numbers and units",
                                   what, at.x(), at.y(), at.z(), kCoordinateMaxM),
                   {{"field", "map_t_other"},
                    {"value", absl::StrCat(at.x(), ",", at.y(), ",", at.z())},
                    {"bound", absl::StrCat(kCoordinateMaxM)}});
}

absl::Status CheckNodes(const MapContent& theirs) {
  for (const Node& node : theirs.nodes) {
    const std::string what = absl::StrCat("node ", ToString(node.id));
    DSG_RETURN_IF_ERROR(CheckPoint(node.map_T_node.position, what));
    if (node.object.has_value() && node.object->model.has_value()) {
      DSG_RETURN_IF_ERROR(CheckPoint(node.object->map_T_model.position, "the model of " + what));
    }
    if (node.structure.has_value()) {
      const Eigen::Vector3d from_origin(node.structure->plane_offset_m, 0.0, 0.0);
      DSG_RETURN_IF_ERROR(CheckPoint(from_origin, "the plane of " + what));
    }
    if (!node.region.has_value()) continue;
    for (const Eigen::Vector2d& corner : node.region->footprint_map) {
      DSG_RETURN_IF_ERROR(CheckPoint({corner.x(), corner.y(), 0.0}, "a corner of " + what));
    }
  }
  return absl::OkStatus();
}

absl::Status TooFarInTime(TimeNs time_ns, const MapSpec& into, const std::string& agent) {
  return MakeError(
      Reason::kTimeOutsideMap,
      absl::StrCat("the track of ", agent, " has poses at ", time_ns,
                   " ns, more than ten years from the epoch ", into.epoch_ns, " ns of map \"",
                   into.name, "\"; ingest the log of map \"", into.name,
                   "\" again with an --epoch within ten years of both, or mend the clock of the "
                   "other log"),
      {{"map", into.name}, {"time_ns", absl::StrCat(time_ns)}});
}

absl::Status CheckTrack(const MapSpec& into, const Snapshot& other, const TrackInfo& track,
                        const Pose3d& map_T_other, const StopCheck& stop) {
  const std::string what =
      absl::StrCat("agent ", ToString(track.agent), " of map \"", other.spec().name, "\"");
  if (track.pose_count > 0) {
    for (const TimeNs time_ns : {track.first_ns, track.last_ns}) {
      // Nearer than a map takes poses, since both maps are to be one.
      const bool is_near = CheckTimeInMap(time_ns, into).ok() &&
                           std::abs(time_ns - into.epoch_ns) <= kObservedFarMaxNs;
      if (!is_near) return TooFarInTime(time_ns, into, what);
    }
  }
  absl::Status status;
  DSG_RETURN_IF_ERROR(
      other.ReadPoses(track.agent, kTimeMin, kTimeMax, stop, [&](const TimedPose& pose) {
        status = CheckPoint(map_T_other * pose.map_T_agent.position, "a pose of " + what);
        return status.ok();
      }));
  DSG_RETURN_IF_ERROR(status);
  DSG_ASSIGN_OR_RETURN(std::vector<PoseFactor> factors,
                       other.Factors(track.agent, kTimeMin, kTimeMax));
  for (PoseFactor& factor : factors) {
    TransformFactor(map_T_other, &factor);
    DSG_RETURN_IF_ERROR(CheckPoint(factor.relative_pose.position, "a factor of " + what));
  }
  return absl::OkStatus();
}

absl::Status CheckMesh(const Snapshot& other, const Pose3d& map_T_other, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, other.MeshBlocks());
  for (const BlockIndex& index : blocks) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, other.ReadMeshBlock(index));
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& position : block.positions_map) box.extend(position);
    if (box.isEmpty()) continue;
    const Box3d carried = TransformBox(map_T_other, box.cast<double>());
    for (const Eigen::Vector3d& corner : {carried.min(), carried.max()}) {
      DSG_RETURN_IF_ERROR(
          CheckPoint(corner, absl::StrCat("mesh block ", index.x, ",", index.y, ",", index.z)));
    }
  }
  return absl::OkStatus();
}

// What CheckDelta asks of the map, told from its content in memory.
class ContentLookup final : public GraphLookup {
 public:
  explicit ContentLookup(const MapContent& content) : content_(content) {
    for (const Edge& edge : content.edges) {
      if (edge.relation != relations::kContains) continue;
      parents_[edge.target].push_back(edge.source);
      children_[edge.source].push_back(edge.target);
    }
    for (const TrackInfo& track : content.tracks) {
      if (track.pose_count > 0) track_ends_[track.agent] = track.last_ns;
    }
  }

  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override {
    const int index = content_.IndexOf(id);
    if (index < 0) return std::optional<NodeFacts>();
    const Node& node = content_.nodes[static_cast<size_t>(index)];
    return std::optional<NodeFacts>(NodeFacts{node.layer, IsAgentKind(node.kind), node.valid,
                                              node.box_node.isEmpty() ? Box3d() : node.BoxMap(),
                                              node.map_T_node.position, node.first_observed_ns,
                                              node.last_observed_ns});
  }
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override {
    for (const Layer& layer : content_.layers) {
      if (layer.id == id) return std::optional<Layer>(layer);
    }
    return std::optional<Layer>();
  }
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override {
    return Listed(parents_, id);
  }
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override {
    return Listed(children_, id);
  }
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override {
    const auto found = track_ends_.find(agent);
    return found == track_ends_.end() ? std::optional<TimeNs>() : found->second;
  }
  // Those that the graph refers to are written before it.
  absl::StatusOr<bool> HasAsset(const Sha256& /*sha256*/) const override { return true; }
  const MapSpec* FindSpec() const override { return &content_.spec; }
  absl::StatusOr<std::optional<Interval>> FindSpan() const override {
    std::optional<Interval> span;
    for (const TrackInfo& track : content_.tracks) {
      if (track.pose_count == 0) continue;
      if (!span.has_value()) span = {track.first_ns, track.last_ns};
      span->from_ns = std::min(span->from_ns, track.first_ns);
      span->to_ns = std::max(span->to_ns, track.last_ns);
    }
    return span;
  }

 private:
  using Family = std::map<NodeId, std::vector<NodeId>>;

  static std::vector<NodeId> Listed(const Family& family, NodeId id) {
    const auto found = family.find(id);
    return found == family.end() ? std::vector<NodeId>() : found->second;
  }

  const MapContent& content_;
  Family parents_;
  Family children_;
  std::map<NodeId, TimeNs> track_ends_;
};

}  // namespace

absl::Status CheckReach(const MapSpec& into, const Snapshot& other, const MapContent& theirs,
                        const Pose3d& map_T_other, const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(CheckNodes(theirs));
  for (const TrackInfo& track : theirs.tracks) {
    DSG_RETURN_IF_ERROR(CheckTrack(into, other, track, map_T_other, stop));
  }
  return CheckMesh(other, map_T_other, stop);
}

absl::Status CheckGraph(const MapContent& mine, MergePlan* plan) {
  plan->graph.session_id = "merge";
  plan->graph.sequence = 1;
  return CheckDelta(plan->graph, ContentLookup(mine));
}

}  // namespace dsg::merge
