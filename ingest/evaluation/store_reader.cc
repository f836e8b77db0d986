// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/store_reader.h"

#include <map>
#include <optional>
#include <utility>

#include "ingest/evaluation/robot_tracks.h"
#include "schema/base/status.h"

namespace dsg::evaluation {
namespace {

constexpr char kDetectionPrior[] = "detection_prior";

StopCheck NeverStop() {
  return [] { return absl::OkStatus(); };
}

/// Node ids to the indices of the estimate.
using Indices = std::map<NodeId, int>;

int IndexOf(const Indices& indices, NodeId id) {
  const auto found = indices.find(id);
  return found == indices.end() ? -1 : found->second;
}

class Reader {
 public:
  Reader(MapReader& map, const Snapshot& snapshot, const ProgressFunction& progress)
      : map_(map), snapshot_(snapshot), progress_(progress) {}

  absl::StatusOr<Estimate> Read() {
    out_.map = snapshot_.spec().name;
    out_.revision = snapshot_.revision();
    DSG_ASSIGN_OR_RETURN(out_.labels, snapshot_.Labels());
    DSG_RETURN_IF_ERROR(ReadNodes());
    DSG_RETURN_IF_ERROR(ReadEdges());
    DSG_RETURN_IF_ERROR(ReadTracks());
    DSG_RETURN_IF_ERROR(ReadMesh());
    return std::move(out_);
  }

 private:
  void Tell(const std::string& what, double fraction) const {
    if (progress_) progress_(what, fraction);
  }

  absl::Status ReadNodes() {
    Tell("nodes", 0.0);
    return snapshot_.ScanNodes({}, NodeId(), NeverStop(), [this](const Node& node) {
      if (node.kind == kinds::kObject) AddObject(node);
      if (node.kind == kinds::kPlace) AddPlace(node);
      if (node.kind == kinds::kRoom) rooms_.emplace(node.id, out_.room_count++);
      return true;
    });
  }

  void AddObject(const Node& node) {
    EstimatedObject object;
    object.class_name = node.class_name;
    object.position_map = node.map_T_node.position;
    object.valid = node.valid;
    if (!node.box_node.isEmpty()) object.box_map = node.BoxMap();
    if (node.object.has_value() && node.object->model.has_value()) {
      object.map_T_model = node.object->map_T_model;
    }
    objects_.emplace(node.id, static_cast<int>(out_.objects.size()));
    out_.objects.push_back(std::move(object));
  }

  void AddPlace(const Node& node) {
    places_.emplace(node.id, static_cast<int>(out_.places.size()));
    const double clearance_m = node.place.has_value() ? node.place->clearance_m : 0.0;
    out_.places.push_back({node.map_T_node.position, clearance_m});
    out_.room_of_place.push_back(-1);
  }

  absl::Status ReadEdges() {
    const auto scan = [this](const char* relation, const std::function<void(const Edge&)>& add) {
      EdgeFilter filter;
      filter.relation = relation;
      return snapshot_.ScanEdges(filter, std::nullopt, NeverStop(), [&add](const Edge& edge) {
        add(edge);
        return true;
      });
    };
    DSG_RETURN_IF_ERROR(scan(relations::kContains, [this](const Edge& edge) {
      const int room = IndexOf(rooms_, edge.source);
      const int place = IndexOf(places_, edge.target);
      if (room >= 0 && place >= 0) out_.room_of_place[static_cast<size_t>(place)] = room;
    }));
    DSG_RETURN_IF_ERROR(scan(relations::kTraversable, [this](const Edge& edge) {
      const int a = IndexOf(places_, edge.source);
      const int b = IndexOf(places_, edge.target);
      if (a >= 0 && b >= 0) out_.place_edges.emplace_back(a, b);
    }));
    DSG_RETURN_IF_ERROR(scan(relations::kAdjacent, [this](const Edge& edge) {
      const int a = IndexOf(rooms_, edge.source);
      const int b = IndexOf(rooms_, edge.target);
      if (a >= 0 && b >= 0) out_.adjacent_rooms.emplace_back(a, b);
    }));
    for (const char* relation : kScoredRelations) {
      DSG_RETURN_IF_ERROR(scan(relation, [this](const Edge& edge) { AddRelation(edge); }));
    }
    return scan(relations::kHeldBy, [this](const Edge& edge) { held_.push_back(edge); });
  }

  void AddRelation(const Edge& edge) {
    const int source = IndexOf(objects_, edge.source);
    if (source < 0 || edge.valid.to_ns != kTimeMax) return;
    out_.relations.push_back({edge.relation, source, IndexOf(objects_, edge.target)});
  }

  absl::Status ReadTracks() {
    DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot_.Tracks());
    Indices people;
    for (const TrackInfo& track : tracks) {
      if (track.kind == kinds::kHuman) {
        const int index = static_cast<int>(people.size());
        people.emplace(track.agent, index);
        Tell("people", static_cast<double>(index) / static_cast<double>(tracks.size()));
        DSG_RETURN_IF_ERROR(ReadPerson(track, index));
      }
    }
    for (const Edge& edge : held_) {
      out_.holdings.push_back({IndexOf(objects_, edge.source), IndexOf(people, edge.target),
                               edge.valid.from_ns, edge.weight});
    }
    return ReadRobot();
  }

  absl::Status ReadPerson(const TrackInfo& track, int index) {
    DSG_ASSIGN_OR_RETURN(const std::vector<PoseFactor> factors,
                         snapshot_.Factors(track.agent, kTimeMin, kTimeMax));
    for (const PoseFactor& factor : factors) {
      if (factor.type != kDetectionPrior || factor.from_ns != factor.to_ns) continue;
      out_.detection_priors.push_back({factor.from_ns, index, factor.relative_pose.position});
    }
    if (track.pose_count == 0) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const std::vector<StampedPose> poses,
                         ReadStampedPoses(snapshot_, track.agent, kTimeMin, kTimeMax));
    for (const StampedPose& pose : poses) {
      out_.torsos.push_back({pose.time_ns, index, pose.map_T_body.position});
    }
    return ReadBodies(track.agent, index, poses);
  }

  absl::Status ReadBodies(NodeId agent, int index, const std::vector<StampedPose>& poses) {
    DSG_ASSIGN_OR_RETURN(std::vector<BodyShape> shapes,
                         snapshot_.Shapes(agent, kTimeMin, kTimeMax));
    size_t at = 0;
    for (BodyShape& shape : shapes) {
      while (at < poses.size() && poses[at].time_ns < shape.time_ns) ++at;
      if (at == poses.size() || poses[at].time_ns != shape.time_ns) continue;
      out_.bodies.push_back({shape.time_ns, index, poses[at].map_T_body, std::move(shape.joints),
                             std::move(shape.vertices)});
    }
    return absl::OkStatus();
  }

  absl::Status ReadRobot() {
    DSG_ASSIGN_OR_RETURN(std::optional<RobotTracks> robot,
                         ReadRobotTracks(map_, snapshot_, "", progress_));
    if (!robot.has_value()) return absl::OkStatus();
    out_.robot_causal = std::move(robot->causal);
    out_.robot = std::move(robot->corrected);
    out_.notes.insert(out_.notes.end(), robot->notes.begin(), robot->notes.end());
    return absl::OkStatus();
  }

  absl::Status ReadMesh() {
    DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, snapshot_.MeshBlocks());
    bool has_labels = !blocks.empty();
    for (size_t i = 0; i < blocks.size(); ++i) {
      Tell("mesh blocks", static_cast<double>(i) / static_cast<double>(blocks.size()));
      DSG_ASSIGN_OR_RETURN(const MeshBlock block, snapshot_.ReadMeshBlock(blocks[i]));
      MeshBlock& mesh = out_.mesh;
      const auto base = static_cast<uint32_t>(mesh.positions_map.size());
      mesh.positions_map.insert(mesh.positions_map.end(), block.positions_map.begin(),
                                block.positions_map.end());
      if (block.labels.size() != block.positions_map.size()) has_labels = false;
      mesh.labels.insert(mesh.labels.end(), block.labels.begin(), block.labels.end());
      for (const auto& face : block.faces) {
        mesh.faces.push_back({base + face[0], base + face[1], base + face[2]});
      }
    }
    if (!has_labels) out_.mesh.labels.clear();
    return absl::OkStatus();
  }

  MapReader& map_;
  const Snapshot& snapshot_;
  const ProgressFunction& progress_;
  Estimate out_;
  Indices objects_;
  Indices places_;
  Indices rooms_;
  std::vector<Edge> held_;
};

}  // namespace

absl::StatusOr<Estimate> ReadEstimate(MapReader& map, Revision revision,
                                      const ProgressFunction& progress) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> snapshot,
                       revision == 0 ? map.Latest() : map.At(revision));
  return Reader(map, *snapshot, progress).Read();
}

}  // namespace dsg::evaluation
