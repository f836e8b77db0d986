// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/agent_obstacles.h"

#include <algorithm>
#include <utility>

#include "query/prediction/prediction.h"
#include "query/prediction/track.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

absl::StatusOr<Obstacle> AgentAt(const Snapshot& snapshot, NodeId agent, const Pose3d& map_T_agent,
                                 ObstacleKind kind, double grown_m) {
  DSG_ASSIGN_OR_RETURN(const Node node, snapshot.GetNode(agent));
  Obstacle obstacle;
  obstacle.kind = kind;
  obstacle.node = agent;
  if (!node.box_node.isEmpty()) {
    obstacle.shape = MakeBox(map_T_agent, node.box_node);
    obstacle.radius_m = grown_m;
    return obstacle;
  }
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() * (0.5 * kAgentHeightM - kAgentRadiusM);
  obstacle.shape = MakeSegment(map_T_agent.position - up, map_T_agent.position + up);
  obstacle.radius_m = kAgentRadiusM + grown_m;
  return obstacle;
}

// Before the smallest number of ns there is nothing.
TimeNs Earlier(TimeNs time_ns, TimeNs by_ns) {
  return time_ns < kTimeMin + by_ns ? kTimeMin : time_ns - by_ns;
}

// When the agent is to be located; nullopt if it is not known to be there then.
std::optional<TimeNs> When(const TrackInfo& track, std::optional<TimeNs> at_ns, TimeNs newest_ns) {
  if (track.pose_count == 0) return std::nullopt;
  if (at_ns.has_value()) {
    if (*at_ns < track.first_ns || *at_ns > track.last_ns) return std::nullopt;
    return at_ns;
  }
  if (track.last_ns < Earlier(newest_ns, track.gap_ns_max)) return std::nullopt;
  return track.last_ns;
}

// What predictions are made from: the same as PredictAgent takes.
absl::StatusOr<std::vector<PathPoint>> LastPoints(const Snapshot& snapshot, const TrackInfo& track,
                                                  const StopCheck& stop) {
  std::vector<PathPoint> path;
  // Poses beyond what is looked at let its first point lie between two.
  const TimeNs window_ns = kTrackSeenNs + std::clamp(track.gap_ns_max, TimeNs{0}, kTrackSeenNs);
  // The last pose is asked for by an end behind it.
  const TimeNs until_ns = track.last_ns == kTimeMax ? kTimeMax : track.last_ns + 1;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadPoses(track.agent, std::max(track.first_ns, Earlier(track.last_ns, window_ns)),
                         until_ns, stop, [&](const TimedPose& pose) {
                           path.push_back({pose.time_ns, pose.map_T_agent.position});
                           return true;
                         }));
  return RecentTrack(path, track.gap_ns_max);
}

}  // namespace

absl::StatusOr<std::vector<Obstacle>> AgentsAt(const Snapshot& snapshot,
                                               std::optional<TimeNs> at_ns, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot.Tracks(stop));
  TimeNs newest_ns = kTimeMin;
  for (const TrackInfo& track : tracks) {
    if (track.pose_count > 0) newest_ns = std::max(newest_ns, track.last_ns);
  }
  std::vector<Obstacle> agents;
  for (const TrackInfo& track : tracks) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    const std::optional<TimeNs> when_ns = When(track, at_ns, newest_ns);
    if (!when_ns.has_value()) continue;
    DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(track.agent, *when_ns));
    if (located.quality == PoseQuality::kInGap) continue;
    DSG_ASSIGN_OR_RETURN(Obstacle agent, AgentAt(snapshot, track.agent, located.map_T_agent,
                                                 ObstacleKind::kAgent, 0.0));
    agents.push_back(std::move(agent));
  }
  return agents;
}

absl::StatusOr<std::vector<Obstacle>> AgentsForeseenAt(const Snapshot& snapshot, TimeNs at_ns,
                                                       const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot.Tracks(stop));
  std::vector<Obstacle> agents;
  for (const TrackInfo& track : tracks) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    if (track.pose_count == 0 || at_ns <= track.last_ns) continue;
    if (track.last_ns < Earlier(at_ns, kForeseenNsMax)) continue;
    DSG_ASSIGN_OR_RETURN(const std::vector<PathPoint> path, LastPoints(snapshot, track, stop));
    if (path.empty()) continue;
    const PredictedPath foreseen = PredictWeightedVelocity(path, {at_ns}, {});
    DSG_ASSIGN_OR_RETURN(const LocatedPose last, snapshot.Locate(track.agent, track.last_ns));
    const Pose3d map_T_agent{foreseen.positions_map.back(), last.map_T_agent.orientation};
    DSG_ASSIGN_OR_RETURN(Obstacle agent,
                         AgentAt(snapshot, track.agent, map_T_agent, ObstacleKind::kPredictedAgent,
                                 kForeseenSigmas * foreseen.sigma_m.back()));
    agents.push_back(std::move(agent));
  }
  return agents;
}

}  // namespace dsg::query
