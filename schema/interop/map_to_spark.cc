// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/map_to_spark.h"

#include <algorithm>
#include <set>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/graph_rest.h"
#include "schema/interop/mesh_join.h"
#include "schema/interop/own_finder.h"
#include "schema/interop/place_finder.h"
#include "schema/interop/spark_agents.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_layer_keys.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_own.h"
#include "schema/interop/spark_rest.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Pair = std::pair<uint64_t, uint64_t>;

Pair PairOf(const Edge& edge) { return std::minmax(edge.source.value, edge.target.value); }

uint64_t StampOf(TimeNs time_ns) { return time_ns > 0 ? static_cast<uint64_t>(time_ns) : 0; }

std::string TextIn(const Attributes& attributes, const char* name) {
  const auto found = attributes.find(name);
  const auto* text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? "" : *text;
}

// Makes the graph as if the format could say all of it; what it cannot is found afterwards.
class GraphMaker {
 public:
  GraphMaker(const MapContents& map, const PoseStep& step)
      : map_(map), step_(step), keys_(map.layers, map.nodes) {}

  SparkExport Make() {
    for (const TrajectoryAppend& track : map_.tracks) tracks_[track.agent] = &track;
    AddNodes();
    AddRobots();
    AddEdges();
    AddLayers();
    if (!map_.mesh.empty()) {
      out_.graph.mesh = JoinBlocks(map_.mesh, map_.spec.mesh_block_size_m);
    }
    return std::move(out_);
  }

 private:
  TimeNs GapOf(const Node& agent) const {
    const bool has_own = agent.agent.has_value() && agent.agent->gap_ns_max > 0;
    return has_own ? agent.agent->gap_ns_max : map_.spec.gap_ns_max;
  }

  std::vector<TimedPose> PosesOf(const Node& agent) const {
    const auto found = tracks_.find(agent.id);
    if (found == tracks_.end()) return {};
    return ThinPoses(found->second->poses, step_, GapOf(agent));
  }

  void AddNodes() {
    for (const Node& node : map_.nodes) {
      if (node.kind == kinds::kRobot) continue;
      SparkNode made = ToSparkWithRest(node, keys_.KeyOf(node));
      if (IsAgentKind(node.kind)) AddWalk(node, &made);
      key_of_[node.id] = made.key;
      exported_.insert(node.id.value);
      out_.graph.nodes.push_back(std::move(made));
    }
  }

  void AddWalk(const Node& human, SparkNode* made) const {
    const std::vector<TimedPose> poses = PosesOf(human);
    if (poses.empty()) return;
    const TimeNs gap_ns = GapOf(human);
    Json positions = Json::array();
    Json times = Json::array();
    Json first = Json::array();
    Json last = Json::array();
    for (size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Vector3d p = poses[i].map_T_agent.position.cast<float>().cast<double>();
      positions.push_back({p.x(), p.y(), p.z()});
      times.push_back(StampOf(poses[i].time_ns));
      const bool begins = i == 0 || poses[i].time_ns - poses[i - 1].time_ns > gap_ns;
      if (begins) {
        first.push_back(times.back());
        last.push_back(times.back());
      }
      last.back() = times.back();
    }
    made->fields["trajectory_positions"] = std::move(positions);
    made->fields["trajectory_timestamps"] = std::move(times);
    made->fields["first_observed_ns"] = std::move(first);
    made->fields["last_observed_ns"] = std::move(last);
  }

  // r0 has a, r1 has b, as imports number them; a letter that ids of nodes begin with is taken.
  char FreeLetter(const Node& robot, std::set<char>* taken) const {
    constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    const size_t wanted = robot.id.index() % kLetters.size();
    for (size_t i = 0; i < kLetters.size(); ++i) {
      const char letter = kLetters[(wanted + i) % kLetters.size()];
      if (taken->insert(letter).second) return letter;
    }
    return '\0';
  }

  void AddRobots() {
    std::set<char> taken;
    for (const SparkNode& node : out_.graph.nodes) taken.insert(NodeId(node.id).letter());
    std::map<char, TimeNs> last_pose_ns;
    std::map<char, uint64_t> next_index;
    for (const Node& node : map_.nodes) {
      if (node.kind != kAgentPoseKind) continue;
      const char letter = node.id.letter();
      last_pose_ns.try_emplace(letter, kTimeMin);
      last_pose_ns[letter] =
          std::max(last_pose_ns[letter], node.last_observed_ns.value_or(kTimeMin));
      next_index[letter] = std::max(next_index[letter], node.id.index() + 1);
    }
    const PlaceFinder places(map_.nodes);
    for (const Node& node : map_.nodes) {
      if (node.kind != kinds::kRobot) continue;
      const std::string known = TextIn(node.attributes, kPosesAttribute);
      const bool has_nodes = known.size() == 1 && next_index.contains(known.front());
      const char letter = has_nodes ? known.front() : FreeLetter(node, &taken);
      if (letter == '\0') {
        out_.notes.push_back(
            absl::StrCat("robot ", ToString(node.id), " was left out: all letters are taken"));
        continue;
      }
      std::vector<TimedPose> poses = PosesOf(node);
      if (has_nodes) {
        std::erase_if(poses,
                      [&](const TimedPose& pose) { return pose.time_ns <= last_pose_ns[letter]; });
      }
      AddPoses(letter, next_index[letter], poses, places);
      robots_.push_back({&node, letter, has_nodes});
    }
    AddOwnRobots();
  }

  void AddPoses(char letter, uint64_t index, const std::vector<TimedPose>& poses,
                const PlaceFinder& places) {
    uint64_t last = index > 0 ? NodeId(letter, index - 1).value : 0;
    for (const TimedPose& pose : poses) {
      SparkNode node;
      node.type = SparkClass::kAgent;
      node.id = NodeId(letter, index++).value;
      node.key = {2, static_cast<uint32_t>(letter)};
      node.stamp_ns = pose.time_ns;
      node.position = pose.map_T_agent.position;
      node.orientation = pose.map_T_agent.orientation;
      node.is_predicted = (pose.flags & pose_flags::kPredicted) != 0;
      node.fields = MakeFields(node);
      if (last != 0) out_.graph.edges.push_back({last, node.id, false, 1.0, "", nullptr});
      const NodeId place = places.Nearest(node.position);
      if (!place.empty()) {
        out_.graph.edges.push_back({node.id, place.value, false, 1.0, "", nullptr});
      }
      last = node.id;
      ++out_.pose_count;
      out_.graph.nodes.push_back(std::move(node));
    }
  }

  void AddOwnRobots() {
    std::vector<Node> nodes;
    for (const Robot& robot : robots_) nodes.push_back(*robot.node);
    const std::vector<Json> items = NodesToJson(nodes, map_.layers);
    for (size_t i = 0; i < items.size() && i < robots_.size(); ++i) {
      Json entry = {{"node", items[i]}};
      if (robots_[i].has_nodes) entry["poses_are_nodes"] = true;
      out_.graph.own["robots"][std::string(1, robots_[i].letter)] = std::move(entry);
    }
  }

  // One edge a pair; FindOwnParts puts the others into its metadata.
  void AddEdges() {
    std::set<Pair> seen;
    std::vector<Edge> others;
    for (const Edge& edge : map_.edges) {
      if (edge.source == edge.target) continue;
      const bool has_ends =
          exported_.contains(edge.source.value) && exported_.contains(edge.target.value);
      if (!has_ends) others.push_back(edge);
      if (!has_ends || !seen.insert(PairOf(edge)).second) continue;
      const auto weighted = edge.attributes.find("weighted");
      SparkEdge made = {edge.source.value,
                        edge.target.value,
                        false,
                        edge.weight,
                        TextIn(edge.attributes, "metadata"),
                        nullptr};
      const bool* flag =
          weighted == edge.attributes.end() ? nullptr : std::get_if<bool>(&weighted->second);
      made.weighted = flag != nullptr && *flag;
      out_.graph.edges.push_back(std::move(made));
    }
    if (!others.empty()) out_.graph.own["edges"] = EdgesToJson(others);
  }

  void AddLayers() {
    SparkGraph& graph = out_.graph;
    std::set<SparkLayerKey> used;
    for (const SparkNode& node : graph.nodes) used.insert(node.key);
    graph.layer_keys.assign(used.begin(), used.end());
    keys_.AddStandardNames(&graph);
    const Json own_layers = keys_.OwnLayers(graph.layer_keys);
    if (!own_layers.empty()) graph.own["layers"] = own_layers;
    const Json spaces = LabelSpacesOf(map_.nodes, key_of_);
    if (!spaces.empty()) graph.metadata["labelspaces"] = spaces;
    AddGraphRest(map_.nodes, &graph);
    keys_.AddOtherNames(graph.layer_keys, &graph);
    graph.own["map"] = map_.spec.name;
    graph.own["revision"] = map_.revision;
  }

  struct Robot {
    const Node* node = nullptr;
    char letter = '\0';
    bool has_nodes = false;
  };

  const MapContents& map_;
  const PoseStep& step_;
  const SparkLayerKeys keys_;
  std::unordered_map<NodeId, const TrajectoryAppend*> tracks_;
  std::map<NodeId, SparkLayerKey> key_of_;
  std::set<uint64_t> exported_;
  std::vector<Robot> robots_;
  SparkExport out_;
};

}  // namespace

absl::StatusOr<SparkExport> MapToSpark(const MapContents& map, const PoseStep& step) {
  SparkExport out = GraphMaker(map, step).Make();
  DSG_RETURN_IF_ERROR(FindOwnParts(map, &out.graph));
  return out;
}

}  // namespace dsg
