// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/own_finder.h"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

#include "schema/base/status.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/json_peek.h"
#include "schema/interop/spark_agents.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_metadata.h"
#include "schema/interop/spark_own.h"
#include "schema/interop/spark_to_delta.h"
#include "schema/interop/spark_writer.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Pair = std::pair<uint64_t, uint64_t>;
using Group = std::vector<const Edge*>;

// Nodes compared at once: texts and trees of both are in memory.
constexpr size_t kChunk = 2048;

Pair PairOf(const Edge& edge) { return std::minmax(edge.source.value, edge.target.value); }

// The letter of the nodes that are a robot's poses; "" for none.
std::string LetterOf(const Node& robot) {
  const auto found = robot.attributes.find(kPosesAttribute);
  const auto* text =
      found == robot.attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? "" : *text;
}

// Imports the graph again, and writes down where that goes wrong.
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
      if (wanted.size() == kChunk) compare();
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
    const std::string letter = LetterOf(*again.at(*id));
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

absl::Status FindOwnParts(const MapContents& map, SparkGraph* graph) {
  return OwnFinder(map, graph).Find();
}

}  // namespace dsg
