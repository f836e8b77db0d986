// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/map_to_spark.h"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_agents.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_mesh.h"
#include "schema/interop/spark_own.h"
#include "schema/interop/spark_rest.h"
#include "schema/interop/spark_to_delta.h"
#include "schema/interop/spark_writer.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Pair = std::pair<uint64_t, uint64_t>;

Pair PairOf(const Edge& edge) { return std::minmax(edge.source.value, edge.target.value); }

std::string TextIn(const Attributes& attributes, const char* name) {
  const auto* text = FindAttribute<std::string>(attributes, name);
  return text == nullptr ? "" : *text;
}

std::vector<TimedPose> ThinPoses(const std::vector<TimedPose>& poses, const PoseStep& step,
                                 TimeNs gap_ns_max) {
  if (step.distance_m <= 0.0) return poses;
  std::vector<TimedPose> kept;
  for (size_t i = 0; i < poses.size(); ++i) {
    const TimedPose& pose = poses[i];
    const bool is_end = i == 0 || i + 1 == poses.size() ||
                        pose.time_ns - poses[i - 1].time_ns > gap_ns_max ||
                        poses[i + 1].time_ns - pose.time_ns > gap_ns_max;
    const bool is_wanted =
        is_end || pose.time_ns - kept.back().time_ns >= step.time_ns ||
        (pose.map_T_agent.position - kept.back().map_T_agent.position).norm() >= step.distance_m;
    if (is_wanted) kept.push_back(pose);
  }
  return kept;
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
      times.push_back(SparkStampOf(poses[i].time_ns));
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
      const std::string known = TextIn(node.attributes, attributes::kSparkPoses);
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

  // One edge a pair; OwnFinder puts the others into its metadata.
  void AddEdges() {
    std::set<Pair> seen;
    std::vector<Edge> others;
    for (const Edge& edge : map_.edges) {
      if (edge.source == edge.target) continue;
      const bool has_ends =
          exported_.contains(edge.source.value) && exported_.contains(edge.target.value);
      if (!has_ends) others.push_back(edge);
      if (!has_ends || !seen.insert(PairOf(edge)).second) continue;
      SparkEdge made = {edge.source.value,
                        edge.target.value,
                        false,
                        edge.weight,
                        TextIn(edge.attributes, "metadata"),
                        nullptr};
      const auto* flag = FindAttribute<bool>(edge.attributes, "weighted");
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

using Group = std::vector<const Edge*>;

// Nodes compared at once: texts and trees of both are in memory.
constexpr size_t kComparedChunk = 2048;

// Sets `own` of nodes, edges and graph, so that an import of the graph gives the nodes and edges of
// the map again: imports the graph, and writes down where that goes wrong.
class OwnFinder {
 public:
  OwnFinder(const MapContents& map, SparkGraph* graph) : map_(map), graph_(*graph) {}

  absl::Status Find() {
    auto back = [this] {
      const SparkGraph read = AsRead();
      for (const SparkNode& node : read.nodes) {
        if (node.type == SparkClass::kAgent) poses_.push_back(node);
      }
      return SparkToDelta(read, "the export", map_.spec.mesh_block_size_m);
    }();
    if (!back.ok()) return back.status();
    FindNodes(back->delta);
    FindEdges(back->delta);
    return absl::OkStatus();
  }

 private:
  // What a reader makes of the file; without the mesh, which has nothing of ours and is large.
  SparkGraph AsRead() const {
    SparkGraph read;
    read.layer_names = graph_.layer_names;
    read.layer_keys = graph_.layer_keys;
    read.edges = graph_.edges;
    ReadGraphMetadata(WithOwn(graph_.metadata, graph_.own), &read);
    JsonSource source{"the export", absl::OkStatus()};
    for (const SparkNode& node : graph_.nodes) {
      SparkNode again;
      again.id = node.id;
      again.key = node.key;
      again.type = node.type;
      ReadSparkAttributes(JsonFields(node.fields, "", &source), &source, &again);
      FinishNode(node.fields, &again);
      read.nodes.push_back(std::move(again));
    }
    return read;
  }

  void FindNodes(const GraphDelta& back) {
    std::unordered_map<uint64_t, SparkNode*> made;
    for (SparkNode& node : graph_.nodes) made[node.id] = &node;
    std::unordered_map<NodeId, const Node*> again;
    for (const Node& node : back.nodes) again[node.id] = &node;
    std::vector<Node> wanted;
    std::vector<Node> found;
    const auto compare = [&] {
      const std::vector<Json> to = NodesToJson(wanted, map_.layers);
      const std::vector<Json> from = NodesToJson(found, back.layers);
      for (size_t i = 0; i < to.size() && i < from.size(); ++i) {
        Json patch = Patch(from[i], to[i]);
        // Always with it, so that an import of the other form, whose numbers are rounded
        // otherwise, takes no difference for something to keep.
        if (!patch.is_null()) patch["attributes"] = Peek(to[i], "attributes");
        made[wanted[i].id.value]->own = std::move(patch);
      }
      wanted.clear();
      found.clear();
    };
    for (const Node& node : map_.nodes) {
      const auto it = again.find(node.id);
      if (it == again.end() || !made.contains(node.id.value)) continue;
      wanted.push_back(node);
      found.push_back(*it->second);
      if (wanted.size() == kComparedChunk) compare();
    }
    compare();
    FindRobots(again);
  }

  // A robot whose poses are nodes of the map comes back by itself if it has not changed.
  void FindRobots(const std::unordered_map<NodeId, const Node*>& again) {
    Json& robots = graph_.own["robots"];
    for (auto it = robots.begin(); it != robots.end();) {
      it = PeekBool(Peek(*it, "poses_are_nodes")) && IsUnchanged(Peek(*it, "node"), again)
               ? robots.erase(it)
               : std::next(it);
    }
    if (robots.empty()) graph_.own.erase("robots");
  }

  // The import that made `again` had the entry; without it the robot would be what its poses say.
  bool IsUnchanged(const Json& node, const std::unordered_map<NodeId, const Node*>& again) const {
    const auto id = ParseNodeId(Peek(node, "id").is_string() ? node["id"].get<std::string>() : "");
    if (!id.ok() || !again.contains(*id)) return false;
    const std::string letter = TextIn(again.at(*id)->attributes, attributes::kSparkPoses);
    SparkGraph bare;
    for (const SparkNode& pose : poses_) {
      const bool is_ours = pose.type == SparkClass::kAgent && letter.size() == 1 &&
                           NodeId(pose.id).letter() == letter.front();
      if (is_ours) bare.nodes.push_back(pose);
    }
    const auto alone = SparkToDelta(bare, "the export", map_.spec.mesh_block_size_m);
    if (!alone.ok()) return false;
    for (const Node& robot : alone->delta.nodes) {
      if (robot.id == *id) return NodesToJson({robot}, {}).front() == node;
    }
    return false;
  }

  static std::map<Pair, Group> ByPair(const std::vector<Edge>& edges) {
    std::map<Pair, Group> pairs;
    for (const Edge& edge : edges) pairs[PairOf(edge)].push_back(&edge);
    for (auto& [pair, group] : pairs) {
      std::sort(group.begin(), group.end(),
                [](const Edge* a, const Edge* b) { return a->key() < b->key(); });
    }
    return pairs;
  }

  void FindEdges(const GraphDelta& back) {
    const auto wanted = ByPair(map_.edges);
    const auto found = ByPair(back.edges);
    for (SparkEdge& edge : graph_.edges) {
      const auto it = wanted.find(std::minmax(edge.source, edge.target));
      if (it == wanted.end()) continue;
      const auto same = found.find(it->first);
      if (same == found.end() || !AreSame(it->second, same->second)) edge.own = AsList(it->second);
    }
  }

  static bool AreSame(const Group& a, const Group& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Edge* x, const Edge* y) {
      return x->key() == y->key() && x->weight == y->weight &&
             x->valid.from_ns == y->valid.from_ns && x->valid.to_ns == y->valid.to_ns &&
             x->attributes == y->attributes;
    });
  }

  static Json AsList(const Group& group) {
    std::vector<Edge> edges;
    for (const Edge* edge : group) edges.push_back(*edge);
    return EdgesToJson(edges);
  }

  const MapContents& map_;
  SparkGraph& graph_;
  /// As read again.
  std::vector<SparkNode> poses_;
};

}  // namespace

absl::StatusOr<SparkExport> MapToSpark(const MapContents& map, const PoseStep& step) {
  SparkExport out = GraphMaker(map, step).Make();
  DSG_RETURN_IF_ERROR(OwnFinder(map, &out.graph).Find());
  return out;
}

}  // namespace dsg
