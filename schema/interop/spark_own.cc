// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_own.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/interop/file_errors.h"
#include "schema/interop/json_cursor.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_agents.h"
#include "schema/model/value_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// Text and trees of a chunk are in memory at once.
constexpr size_t kConvertedChunk = 2048;

std::vector<Json> ItemsOf(const GraphDelta& delta, const char* name) {
  std::vector<Json> items;
  Json root = Json::parse(DeltaToJson(delta), nullptr, false);
  if (!Peek(root, name).is_array()) return items;
  for (Json& item : root[name]) {
    item.erase("revision");
    items.push_back(std::move(item));
  }
  return items;
}

template <typename T>
std::vector<Json> ItemsToJson(const std::vector<T>& all, const std::vector<Layer>& layers,
                              std::vector<T> GraphDelta::*part, const char* name) {
  std::vector<Json> items;
  items.reserve(all.size());
  for (size_t begin = 0; begin < all.size(); begin += kConvertedChunk) {
    GraphDelta delta;
    delta.layers = layers;
    const size_t end = std::min(all.size(), begin + kConvertedChunk);
    (delta.*part)
        .assign(all.begin() + static_cast<std::ptrdiff_t>(begin),
                all.begin() + static_cast<std::ptrdiff_t>(end));
    for (Json& item : ItemsOf(delta, name)) items.push_back(std::move(item));
  }
  return items;
}

template <typename T>
absl::StatusOr<std::vector<T>> ItemsFromJson(const std::vector<Json>& all, const Json& layers,
                                             std::vector<T> GraphDelta::*part, const char* name) {
  std::vector<T> items;
  items.reserve(all.size());
  for (size_t begin = 0; begin < all.size(); begin += kConvertedChunk) {
    Json root = {{"layers", layers}, {name, Json::array()}};
    const size_t end = std::min(all.size(), begin + kConvertedChunk);
    for (size_t i = begin; i < end; ++i) root[name].push_back(all[i]);
    DSG_ASSIGN_OR_RETURN(GraphDelta delta, DeltaFromJson(DumpJson(root)));
    for (T& item : delta.*part) items.push_back(std::move(item));
  }
  return items;
}

}  // namespace

std::vector<Json> NodesToJson(const std::vector<Node>& nodes, const std::vector<Layer>& layers) {
  return ItemsToJson(nodes, layers, &GraphDelta::nodes, "nodes");
}

std::vector<Json> EdgesToJson(const std::vector<Edge>& edges) {
  return ItemsToJson(edges, {}, &GraphDelta::edges, "edges");
}

absl::StatusOr<std::vector<Node>> NodesFromJson(const std::vector<Json>& nodes,
                                                const std::vector<Layer>& layers) {
  Json named = Json::array();
  for (const Layer& layer : layers) {
    named.push_back({{"id", layer.id}, {"name", layer.name}, {"rank", layer.rank}});
  }
  return ItemsFromJson(nodes, named, &GraphDelta::nodes, "nodes");
}

absl::StatusOr<std::vector<Edge>> EdgesFromJson(const std::vector<Json>& edges) {
  return ItemsFromJson(edges, Json::array(), &GraphDelta::edges, "edges");
}

Json Patch(const Json& from, const Json& to) {
  Json patch = Json::object();
  for (const auto& [name, value] : to.items()) {
    const auto found = from.find(name);
    if (found == from.end() || *found != value) patch[name] = value;
  }
  for (const auto& [name, value] : from.items()) {
    if (!to.contains(name)) patch[name] = nullptr;
  }
  return patch.empty() ? Json() : patch;
}

void ApplyPatch(const Json& patch, Json* node) {
  if (!patch.is_object()) return;
  for (const auto& [name, value] : patch.items()) {
    if (name == "id") continue;
    if (value.is_null()) {
      node->erase(name);
    } else {
      (*node)[name] = value;
    }
  }
}

namespace {

using EndPair = std::pair<uint64_t, uint64_t>;

EndPair EndsOf(uint64_t a, uint64_t b) { return std::minmax(a, b); }

class OwnTaker {
 public:
  OwnTaker(const SparkGraph& graph, const SparkLayers& layers, const std::string& file,
           Skips* skips, GraphDelta* delta)
      : graph_(graph), layers_(layers), file_(file), skips_(*skips), delta_(*delta) {}

  absl::Status Take() {
    DSG_RETURN_IF_ERROR(TakeNodes());
    DSG_RETURN_IF_ERROR(TakeEdges());
    DSG_RETURN_IF_ERROR(TakeRobots());
    TakeWalks();
    if (!is_changed_) return absl::OkStatus();
    DropDanglingEdges();
    DropUnusedLayers();
    FitBoxesToChildren(&delta_);
    return absl::OkStatus();
  }

 private:
  absl::Status Fail(const std::string& where, const absl::Status& status) const {
    return FileError(
        file_, where,
        absl::StrCat("metadata \"", kOwnMetadata, "\" does not read as what an export writes (",
                     std::string(status.message()), "); remove it"));
  }

  std::vector<Layer> KnownLayers() const {
    std::vector<Layer> known = delta_.layers;
    for (const auto& [key, layer] : layers_.own_layers()) known.push_back(layer);
    return known;
  }

  absl::Status TakeNodes() {
    std::unordered_map<NodeId, const Json*> patches;
    for (const SparkNode& node : graph_.nodes) {
      if (node.own.is_object()) patches[NodeId(node.id)] = &node.own;
    }
    if (patches.empty()) return absl::OkStatus();
    is_changed_ = true;
    std::vector<Node> touched;
    std::vector<size_t> at;
    for (size_t i = 0; i < delta_.nodes.size(); ++i) {
      if (!patches.contains(delta_.nodes[i].id)) continue;
      touched.push_back(delta_.nodes[i]);
      at.push_back(i);
    }
    const std::vector<Layer> known = KnownLayers();
    std::vector<Json> items = NodesToJson(touched, known);
    for (size_t i = 0; i < items.size(); ++i) ApplyPatch(*patches.at(touched[i].id), &items[i]);
    auto nodes = NodesFromJson(items, known);
    if (!nodes.ok()) return Fail("nodes", nodes.status());
    for (size_t i = 0; i < nodes->size() && i < at.size(); ++i) {
      delta_.nodes[at[i]] = std::move((*nodes)[i]);
    }
    return absl::OkStatus();
  }

  absl::Status TakeEdges() {
    std::set<EndPair> replaced;
    std::vector<Json> items;
    for (const SparkEdge& edge : graph_.edges) {
      if (!edge.own.is_array()) continue;
      replaced.insert(EndsOf(edge.source, edge.target));
      items.insert(items.end(), edge.own.begin(), edge.own.end());
    }
    // Those of robots, which are no nodes of the file.
    const Json& others = Peek(graph_.own, "edges");
    if (others.is_array()) items.insert(items.end(), others.begin(), others.end());
    if (items.empty() && replaced.empty()) return absl::OkStatus();
    is_changed_ = true;
    auto edges = EdgesFromJson(items);
    if (!edges.ok()) return Fail("edges", edges.status());
    std::erase_if(delta_.edges, [&](const Edge& edge) {
      return replaced.contains(EndsOf(edge.source.value, edge.target.value));
    });
    for (Edge& edge : *edges) delta_.edges.push_back(std::move(edge));
    return absl::OkStatus();
  }

  // "robots": {"a": {"node": {...}, "poses_are_nodes": false}}.
  absl::Status TakeRobots() {
    const Json& robots = Peek(graph_.own, "robots");
    if (!robots.is_object() || robots.empty()) return absl::OkStatus();
    is_changed_ = true;
    std::unordered_map<NodeId, NodeId> renamed;
    std::set<char> letters;
    std::vector<Json> items;
    std::vector<Node*> made;
    for (const auto& [letter, entry] : robots.items()) {
      Node* robot = RobotNamed(letter);
      if (robot == nullptr || !Peek(entry, "node").is_object()) continue;
      items.push_back(entry["node"]);
      made.push_back(robot);
      if (!PeekBool(Peek(entry, "poses_are_nodes"))) letters.insert(letter.front());
    }
    auto nodes = NodesFromJson(items, KnownLayers());
    if (!nodes.ok()) return Fail("robots", nodes.status());
    for (size_t i = 0; i < made.size() && i < nodes->size(); ++i) {
      renamed[made[i]->id] = (*nodes)[i].id;
      *made[i] = std::move((*nodes)[i]);
    }
    Rename(renamed);
    DropPoses(letters);
    return absl::OkStatus();
  }

  // What AddSparkAgents made of the poses of a letter.
  Node* RobotNamed(const std::string& letter) {
    if (letter.size() != 1) return nullptr;
    for (Node& node : delta_.nodes) {
      if (node.kind == kinds::kRobot && node.name == letter) return &node;
    }
    return nullptr;
  }

  void Rename(const std::unordered_map<NodeId, NodeId>& renamed) {
    const auto rename = [&](NodeId* id) {
      const auto found = renamed.find(*id);
      if (found != renamed.end()) *id = found->second;
    };
    for (TrajectoryAppend& append : delta_.appends) rename(&append.agent);
    for (Stay& stay : delta_.stays) rename(&stay.agent);
  }

  void DropPoses(const std::set<char>& letters) {
    std::unordered_set<NodeId> dropped;
    for (const Node& node : delta_.nodes) {
      const bool is_pose = node.kind == kAgentPoseKind && letters.contains(node.id.letter());
      if (is_pose) dropped.insert(node.id);
    }
    std::erase_if(delta_.nodes, [&](const Node& node) { return dropped.contains(node.id); });
    std::erase_if(delta_.edges, [&](const Edge& edge) {
      return dropped.contains(edge.source) || dropped.contains(edge.target);
    });
  }

  // Of people, who were written as Khronos objects.
  void TakeWalks() {
    std::unordered_map<NodeId, const SparkNode*> walkers;
    for (const SparkNode& node : graph_.nodes) {
      if (node.type == SparkClass::kKhronosObject) walkers[NodeId(node.id)] = &node;
    }
    if (walkers.empty()) return;
    const PlaceFinder places(delta_.nodes);
    const Whereabouts whereabouts(delta_);
    for (const Node& node : delta_.nodes) {
      const auto walker = walkers.find(node.id);
      if (walker == walkers.end() || !IsAgentKind(node.kind)) continue;
      TrajectoryAppend append = {node.id, PosesOf(SparseFieldsOf(*walker->second))};
      if (append.poses.empty()) continue;
      is_changed_ = true;
      std::vector<Visit> visits;
      for (const TimedPose& pose : append.poses) {
        const NodeId place = places.Nearest(pose.map_T_agent.position);
        visits.push_back({pose.time_ns, place, whereabouts.RoomOfPlace(place)});
      }
      AddStays(node.id, visits, &delta_.stays);
      delta_.appends.push_back(std::move(append));
    }
  }

  static std::vector<TimedPose> PosesOf(const Json& fields) {
    const Json& positions = Peek(fields, "trajectory_positions");
    const Json& times = Peek(fields, "trajectory_timestamps");
    std::vector<TimedPose> poses;
    for (size_t i = 0; positions.is_array() && i < positions.size(); ++i) {
      TimedPose pose;
      pose.time_ns = StampOrZero(PeekUnsigned(PeekAt(times, i)));
      pose.flags = pose_flags::kNoOrientation;
      for (size_t axis = 0; axis < 3; ++axis) {
        pose.map_T_agent.position[static_cast<Eigen::Index>(axis)] =
            PeekNumber(PeekAt(positions[i], axis));
      }
      const bool is_sane = values::IsSane(pose.map_T_agent.position) && pose.time_ns < kTimeMax / 2;
      const bool is_later = poses.empty() || pose.time_ns > poses.back().time_ns;
      if (is_sane && is_later) poses.push_back(pose);
    }
    return poses;
  }

  // The metadata of edges can name any node.
  void DropDanglingEdges() {
    std::unordered_set<NodeId> ids;
    for (const Node& node : delta_.nodes) ids.insert(node.id);
    std::erase_if(delta_.edges, [&](const Edge& edge) {
      if (ids.contains(edge.source) && ids.contains(edge.target)) return false;
      const NodeId missing = ids.contains(edge.source) ? edge.target : edge.source;
      skips_.Add(SkipKind::kDanglingEdge,
                 absl::StrCat("edge ", ToString(edge.source), " ", edge.relation, " ",
                              ToString(edge.target)),
                 absl::StrCat("node ", ToString(missing), " is not in the file"));
      return true;
    });
  }

  void DropUnusedLayers() {
    std::set<LayerId> used;
    for (const Node& node : delta_.nodes) used.insert(node.layer);
    for (const auto& [key, layer] : layers_.own_layers()) {
      const auto same = [&id = layer.id](const Layer& known) { return known.id == id; };
      const auto& standard = DefaultLayers();
      const bool is_known = std::any_of(standard.begin(), standard.end(), same) ||
                            std::any_of(delta_.layers.begin(), delta_.layers.end(), same);
      if (!is_known && used.contains(layer.id)) delta_.layers.push_back(layer);
    }
    std::erase_if(delta_.layers, [&](const Layer& layer) { return !used.contains(layer.id); });
  }

  const SparkGraph& graph_;
  const SparkLayers& layers_;
  const std::string& file_;
  Skips& skips_;
  GraphDelta& delta_;
  bool is_changed_ = false;
};

}  // namespace

absl::Status TakeOwnParts(const SparkGraph& graph, const SparkLayers& layers,
                          const std::string& file, Skips* skips, GraphDelta* delta) {
  return OwnTaker(graph, layers, file, skips, delta).Take();
}

}  // namespace dsg
