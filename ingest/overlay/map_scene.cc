// SPDX-License-Identifier: Apache-2.0
#include "ingest/overlay/map_scene.h"

#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Detections of a person come several times a second; an older shape is another posture.
constexpr TimeNs kShapeReachNs = 250'000'000;

StopCheck NeverStop() {
  return [] { return absl::OkStatus(); };
}

absl::StatusOr<std::optional<Pose3d>> PoseAt(const Snapshot& snapshot, NodeId agent, TimeNs at_ns) {
  const absl::StatusOr<LocatedPose> located = snapshot.Locate(agent, at_ns);
  if (absl::IsOutOfRange(located.status())) return std::nullopt;
  DSG_RETURN_IF_ERROR(located.status());
  if (located->quality == PoseQuality::kInGap) return std::nullopt;
  return located->map_T_agent;
}

}  // namespace

absl::StatusOr<MapScene> MapScene::Read(std::shared_ptr<const Snapshot> snapshot,
                                        const std::string& robot) {
  MapScene scene(std::move(snapshot));
  DSG_RETURN_IF_ERROR(scene.ReadAgents(robot));
  for (const char* kind : {kinds::kRoom, kinds::kObject}) {
    NodeFilter filter;
    filter.kind = kind;
    DSG_RETURN_IF_ERROR(
        scene.snapshot_->ScanNodes(filter, NodeId(), NeverStop(), [&scene](const Node& node) {
          scene.nodes_.push_back(node);
          return true;
        }));
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, scene.snapshot_->MeshBlocks());
  for (const BlockIndex& index : blocks) {
    DSG_ASSIGN_OR_RETURN(MeshBlock block, scene.snapshot_->ReadMeshBlock(index));
    scene.mesh_.push_back(std::move(block));
  }
  return scene;
}

absl::Status MapScene::ReadAgents(const std::string& robot) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot_->Tracks());
  std::vector<std::string> known;
  std::optional<size_t> chosen;
  for (const TrackInfo& track : tracks) {
    if (track.pose_count == 0) continue;
    DSG_ASSIGN_OR_RETURN(Node node, snapshot_->GetNode(track.agent));
    if (track.kind == kinds::kRobot) {
      known.push_back(absl::StrCat(ToString(track.agent), " (", track.name, ")"));
      const bool is_meant = robot.empty() || robot == track.name || robot == ToString(track.agent);
      if (is_meant && !chosen.has_value()) chosen = agents_.size();
    }
    agents_.push_back({std::move(node), agents_.size(), track.gap_ns_max});
  }
  if (chosen.has_value()) {
    robot_ = *chosen;
    return absl::OkStatus();
  }
  return MakeError(Reason::kAgentUnknown,
                   absl::StrCat("map ", snapshot_->spec().name, " has no robot ",
                                robot.empty() ? "" : absl::StrCat("\"", robot, "\" "),
                                "with poses, from which its pictures could be seen; it has ",
                                known.empty() ? "none" : absl::StrJoin(known, ", ")),
                   {{"agent", robot}});
}

absl::StatusOr<std::optional<Pose3d>> MapScene::RobotAt(TimeNs at_ns) const {
  return PoseAt(*snapshot_, robot().node.id, at_ns);
}

absl::StatusOr<std::vector<SeenAgent>> MapScene::OthersAt(TimeNs at_ns, TimeNs trail_ns) const {
  std::vector<SeenAgent> others;
  for (const SceneAgent& agent : agents_) {
    if (&agent == &robot()) continue;
    DSG_ASSIGN_OR_RETURN(const std::optional<Pose3d> pose,
                         PoseAt(*snapshot_, agent.node.id, at_ns));
    if (!pose.has_value()) continue;
    SeenAgent seen{.agent = &agent, .map_T_agent = *pose, .trail = {}, .joints = {}};
    DSG_RETURN_IF_ERROR(ReadTrail(at_ns, trail_ns, &seen));
    DSG_RETURN_IF_ERROR(ReadJoints(at_ns, &seen));
    others.push_back(std::move(seen));
  }
  return others;
}

absl::Status MapScene::ReadTrail(TimeNs at_ns, TimeNs trail_ns, SeenAgent* seen) const {
  std::optional<TimeNs> last_ns;
  const auto add = [&](TimeNs time_ns, const Eigen::Vector3d& point_map) {
    if (!last_ns.has_value() || time_ns - *last_ns > seen->agent->gap_ns) {
      seen->trail.emplace_back();
    }
    seen->trail.back().push_back(point_map);
    last_ns = time_ns;
  };
  DSG_RETURN_IF_ERROR(snapshot_->ReadPoses(seen->agent->node.id, at_ns - trail_ns, at_ns,
                                           NeverStop(), [&](const TimedPose& pose) {
                                             add(pose.time_ns, pose.map_T_agent.position);
                                             return true;
                                           }));
  add(at_ns, seen->map_T_agent.position);
  return absl::OkStatus();
}

absl::Status MapScene::ReadJoints(TimeNs at_ns, SeenAgent* seen) const {
  TimeNs nearest_ns = kShapeReachNs + 1;
  const auto visit = [&](const ShownShape& shown) {
    const TimeNs apart_ns = std::abs(shown.shape.time_ns - at_ns);
    if (apart_ns >= nearest_ns) return true;
    nearest_ns = apart_ns;
    seen->joints.clear();
    const std::vector<float>& joints = shown.shape.joints;
    for (size_t i = 0; i + 2 < joints.size(); i += 3) {
      seen->joints.push_back(
          Eigen::Vector3f(joints[i], joints[i + 1], joints[i + 2]).cast<double>());
    }
    return true;
  };
  return snapshot_->ReadShapes(seen->agent->node.id, at_ns - kShapeReachNs,
                               at_ns + kShapeReachNs + 1, /*with_vertices=*/false, NeverStop(),
                               visit);
}

}  // namespace dsg::ingest
