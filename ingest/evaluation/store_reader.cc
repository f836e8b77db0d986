// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/store_reader.h"

#include <algorithm>
#include <map>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::evaluation {
namespace {

constexpr int kRevisionPage = 1000;
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

absl::StatusOr<std::vector<StampedPose>> ReadPoses(const Snapshot& snapshot, NodeId agent,
                                                   TimeNs from_ns, TimeNs to_ns) {
  std::vector<StampedPose> poses;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadPoses(agent, from_ns, to_ns, NeverStop(), [&poses](const TimedPose& pose) {
        if ((pose.flags & pose_flags::kPredicted) == 0) {
          poses.push_back({pose.time_ns, pose.map_T_agent});
        }
        return true;
      }));
  return poses;
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
    return scan(relations::kHeldBy, [this](const Edge& edge) { held_.push_back(edge); });
  }

  absl::Status ReadTracks() {
    DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot_.Tracks());
    Indices people;
    const TrackInfo* robot = nullptr;
    int robot_count = 0;
    for (const TrackInfo& track : tracks) {
      if (track.kind == kinds::kHuman) {
        const int index = static_cast<int>(people.size());
        people.emplace(track.agent, index);
        Tell("people", static_cast<double>(index) / static_cast<double>(tracks.size()));
        DSG_RETURN_IF_ERROR(ReadPerson(track, index));
      }
      if (track.kind != kinds::kRobot || track.pose_count == 0) continue;
      ++robot_count;
      if (robot == nullptr) robot = &track;
    }
    for (const Edge& edge : held_) {
      out_.holdings.push_back({IndexOf(objects_, edge.source), IndexOf(people, edge.target),
                               edge.valid.from_ns, edge.weight});
    }
    if (robot_count > 1) {
      out_.notes.push_back(absl::StrCat("the map has ", robot_count, " robots; only ",
                                        ToString(robot->agent), " (", robot->name, ") is scored"));
    }
    return robot == nullptr ? absl::OkStatus() : ReadRobot(*robot);
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
                         ReadPoses(snapshot_, track.agent, kTimeMin, kTimeMax));
    for (const StampedPose& pose : poses) {
      out_.torsos.push_back({pose.time_ns, index, pose.map_T_body.position});
    }
    return absl::OkStatus();
  }

  absl::Status ReadRobot(const TrackInfo& robot) {
    DSG_ASSIGN_OR_RETURN(out_.robot, ReadPoses(snapshot_, robot.agent, kTimeMin, kTimeMax));
    DSG_ASSIGN_OR_RETURN(const std::vector<Revision> revisions, GrowingRevisions());
    // Up to and with this stamp, what was first said is known.
    std::optional<TimeNs> known_ns;
    int chunk_count = 0;
    for (size_t i = 0; i < revisions.size(); ++i) {
      Tell("causal trajectory", static_cast<double>(i) / static_cast<double>(revisions.size()));
      DSG_ASSIGN_OR_RETURN(const auto then, map_.At(revisions[i]));
      const auto track = then->GetTrack(robot.agent);
      // Not there yet.
      if (absl::IsNotFound(track.status())) continue;
      DSG_RETURN_IF_ERROR(track.status());
      if (track->pose_count == 0 || (known_ns.has_value() && track->last_ns <= *known_ns)) continue;
      const TimeNs from_ns = known_ns.has_value() ? *known_ns + 1 : kTimeMin;
      DSG_ASSIGN_OR_RETURN(const std::vector<StampedPose> poses,
                           ReadPoses(*then, robot.agent, from_ns, kTimeMax));
      out_.robot_causal.insert(out_.robot_causal.end(), poses.begin(), poses.end());
      known_ns = track->last_ns;
      ++chunk_count;
    }
    if (chunk_count == 1) {
      out_.notes.push_back(
          "the robot's poses came in one revision, so the store cannot tell causal poses from "
          "smoothed ones: ate_m may be of smoothed poses");
    }
    return absl::OkStatus();
  }

  // Ascending; only those after which there were more poses than before.
  absl::StatusOr<std::vector<Revision>> GrowingRevisions() {
    DSG_ASSIGN_OR_RETURN(const Revision oldest, map_.OldestRevision());
    std::vector<std::pair<Revision, int64_t>> pose_counts;
    Revision before = snapshot_.revision() + 1;
    while (before > 1) {
      DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> page,
                           map_.ListRevisions(before, kRevisionPage));
      if (page.empty()) break;
      for (const RevisionInfo& info : page)
        pose_counts.emplace_back(info.revision, info.pose_count);
      before = page.back().revision;
      if (before <= oldest) break;
    }
    std::reverse(pose_counts.begin(), pose_counts.end());
    if (oldest > 1) {
      out_.notes.push_back(absl::StrCat("revisions before ", oldest,
                                        " are compacted: poses of that time are as smoothed then"));
    }
    std::vector<Revision> revisions;
    int64_t last_count = -1;
    for (const auto& [revision, pose_count] : pose_counts) {
      if (revision >= oldest && pose_count != last_count) revisions.push_back(revision);
      last_count = pose_count;
    }
    return revisions;
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
