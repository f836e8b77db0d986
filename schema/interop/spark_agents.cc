// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_agents.h"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_layers.h"

namespace dsg {
namespace {

constexpr double kPlaceReachM = 4.0;

using Links = std::unordered_map<NodeId, NodeId>;

void KeepLower(NodeId from, NodeId to, Links* links) {
  const auto [it, added] = links->try_emplace(from, to);
  if (!added) it->second = std::min(it->second, to);
}

NodeId Lookup(const Links& links, NodeId from) {
  const auto found = links.find(from);
  return found == links.end() ? NodeId() : found->second;
}

void AddStay(NodeId agent, const Visit& visit, TimeNs exit_ns, std::vector<Stay>* stays) {
  if (visit.place.empty() && visit.room.empty()) return;
  for (TimeNs enter_ns = visit.time_ns; enter_ns < exit_ns; enter_ns += kStayNsMax) {
    const TimeNs cut_ns = exit_ns - enter_ns > kStayNsMax ? enter_ns + kStayNsMax : exit_ns;
    stays->push_back({agent, visit.place, visit.room, enter_ns, cut_ns});
  }
}

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
  robot.attributes[attributes::kSparkPoses] = std::string(1, letter);
  robot.first_observed_ns = track.poses.front().time_ns;
  robot.last_observed_ns = track.poses.back().time_ns;
  robot.observation_count = static_cast<int64_t>(track.poses.size());
  return robot;
}

}  // namespace

PlaceFinder::PlaceFinder(const std::vector<Node>& nodes) {
  for (const Node& node : nodes) {
    if (node.kind == kinds::kPlace) places_.emplace_back(node.map_T_node.position, node.id);
  }
  std::sort(places_.begin(), places_.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first.x(), a.second) < std::pair(b.first.x(), b.second);
  });
}

NodeId PlaceFinder::Nearest(const Eigen::Vector3d& point_map) const {
  NodeId best;
  double best_m = kPlaceReachM;
  const auto begin =
      std::lower_bound(places_.begin(), places_.end(), point_map.x() - kPlaceReachM,
                       [](const auto& place, double x) { return place.first.x() < x; });
  for (auto it = begin; it != places_.end() && it->first.x() <= point_map.x() + best_m; ++it) {
    const double distance_m = (it->first - point_map).norm();
    if (distance_m < best_m || (distance_m == best_m && it->second < best)) {
      best = it->second;
      best_m = distance_m;
    }
  }
  return best;
}

Whereabouts::Whereabouts(const GraphDelta& delta) {
  std::unordered_set<NodeId> rooms;
  for (const Node& node : delta.nodes) {
    if (node.layer == layers::kRooms) rooms.insert(node.id);
  }
  for (const Edge& edge : delta.edges) {
    if (edge.relation == relations::kNearestPlace) KeepLower(edge.source, edge.target, &place_);
    if (edge.relation == kPoseIn && rooms.contains(edge.target)) {
      KeepLower(edge.source, edge.target, &room_);
    }
    if (edge.relation == relations::kContains && rooms.contains(edge.source)) {
      KeepLower(edge.target, edge.source, &room_);
    }
  }
}

NodeId Whereabouts::PlaceOf(NodeId pose) const { return Lookup(place_, pose); }

NodeId Whereabouts::RoomOf(NodeId pose) const {
  const NodeId room_of_place = RoomOfPlace(PlaceOf(pose));
  return room_of_place.empty() ? Lookup(room_, pose) : room_of_place;
}

NodeId Whereabouts::RoomOfPlace(NodeId place) const { return Lookup(room_, place); }

void AddStays(NodeId agent, const std::vector<Visit>& visits, std::vector<Stay>* stays) {
  size_t begin = 0;
  for (size_t i = 0; i < visits.size(); ++i) {
    const bool is_last = i + 1 == visits.size();
    const bool is_lost = is_last || visits[i + 1].time_ns - visits[i].time_ns > kStayGapNs;
    const bool moves_on = is_lost || visits[i + 1].place != visits[begin].place ||
                          visits[i + 1].room != visits[begin].room;
    if (!moves_on) continue;
    // Half-open: one nanosecond more, so that the last pose's own instant is covered.
    const TimeNs exit_ns = is_lost ? visits[i].time_ns + 1 : visits[i + 1].time_ns;
    AddStay(agent, visits[begin], exit_ns, stays);
    begin = i + 1;
  }
}

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
