// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_agents.h"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_peek.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_stays.h"

namespace dsg {
namespace {

// r0 for a, r1 for b, ... r26 for A; the next index when the file uses that id itself.
NodeId RobotId(char letter, const std::unordered_set<NodeId>& taken) {
  const bool is_lower = letter >= 'a' && letter <= 'z';
  auto index = static_cast<uint64_t>(is_lower ? letter - 'a' : 26 + letter - 'A');
  while (taken.contains(NodeId('r', index))) ++index;
  return NodeId('r', index);
}

// Not so in exports of maps that had them as a track only.
bool AreNodes(const SparkGraph& graph, char letter) {
  const nlohmann::json& robot = Peek(Peek(graph.own, "robots"), std::string(1, letter).c_str());
  return robot.is_null() || PeekBool(Peek(robot, "poses_are_nodes"));
}

struct Track {
  std::vector<TimedPose> poses;
  std::vector<Visit> visits;
  int64_t out_of_order_count = 0;
};

Track BuildTrack(const std::vector<std::pair<TimeNs, const Node*>>& poses,
                 const Whereabouts& whereabouts) {
  Track track;
  for (const auto& [time_ns, node] : poses) {
    if (!track.poses.empty() && time_ns <= track.poses.back().time_ns) {
      ++track.out_of_order_count;
      continue;
    }
    track.poses.push_back({time_ns, 0, node->map_T_node, nullptr});
    track.visits.push_back({time_ns, whereabouts.PlaceOf(node->id), whereabouts.RoomOf(node->id)});
  }
  return track;
}

Node RobotNode(NodeId id, char letter, const Track& track) {
  Node robot;
  robot.id = id;
  robot.layer = layers::kAgents;
  robot.kind = kinds::kRobot;
  robot.name = std::string(1, letter);
  robot.map_T_node = track.poses.front().map_T_agent;
  robot.provenance = Provenance::kImported;
  robot.agent = AgentInfo{};
  robot.attributes[kPosesAttribute] = std::string(1, letter);
  robot.first_observed_ns = track.poses.front().time_ns;
  robot.last_observed_ns = track.poses.back().time_ns;
  robot.observation_count = static_cast<int64_t>(track.poses.size());
  return robot;
}

}  // namespace

void AddSparkAgents(const SparkGraph& graph, GraphDelta* delta, std::vector<std::string>* notes) {
  std::unordered_map<NodeId, const Node*> node_of;
  std::unordered_set<NodeId> taken;
  for (const Node& node : delta->nodes) {
    taken.insert(node.id);
    if (node.kind == kAgentPoseKind) node_of[node.id] = &node;
  }
  std::map<char, std::vector<std::pair<TimeNs, const Node*>>> poses_of;
  int64_t untimed_count = 0;
  for (const SparkNode& node : graph.nodes) {
    if (node.type != SparkClass::kAgent) continue;
    if (!node.stamp_ns.has_value()) {
      ++untimed_count;
      continue;
    }
    poses_of[NodeId(node.id).letter()].emplace_back(*node.stamp_ns, node_of.at(NodeId(node.id)));
  }
  if (untimed_count > 0) {
    notes->push_back(absl::StrCat(untimed_count, " poses have no time and are in no track"));
  }
  const Whereabouts whereabouts(*delta);
  std::vector<Node> robots;
  for (auto& [letter, poses] : poses_of) {
    std::sort(poses.begin(), poses.end(),
              [](const auto& a, const auto& b) { return a.second->id < b.second->id; });
    Track track = BuildTrack(poses, whereabouts);
    const NodeId id = RobotId(letter, taken);
    taken.insert(id);
    robots.push_back(RobotNode(id, letter, track));
    AddStays(id, track.visits, &delta->stays);
    notes->push_back(absl::StrCat("robot ", ToString(id), " (", std::string(1, letter), ") has ",
                                  track.poses.size(), " poses",
                                  AreNodes(graph, letter) ? "; each is also kept as a node" : ""));
    if (track.out_of_order_count > 0) {
      notes->push_back(absl::StrCat("robot ", ToString(id), ": ", track.out_of_order_count,
                                    " poses are no later than the one before them; they are kept "
                                    "as nodes and not in the track"));
    }
    delta->appends.push_back({id, std::move(track.poses)});
  }
  // Last, because node_of points into the nodes.
  for (Node& robot : robots) delta->nodes.push_back(std::move(robot));
}

}  // namespace dsg
