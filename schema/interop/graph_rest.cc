// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/graph_rest.h"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_peek.h"
#include "schema/interop/spark_rest.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

constexpr char kLabelSpaces[] = "labelspaces";

const std::map<std::string, SparkLayerKey>& AllStandardNames() {
  static const auto* const names = new std::map<std::string, SparkLayerKey>{
      {"SEGMENTS", {1, 0}},    {"OBJECTS", {2, 0}}, {"AGENTS", {2, 0}},   {"PLACES", {3, 0}},
      {"MESH_PLACES", {3, 1}}, {"ROOMS", {4, 0}},   {"BUILDINGS", {5, 0}}};
  return *names;
}

Json KeyJson(const SparkLayerKey& key) { return {key.layer, key.partition}; }

SparkLayerKey KeyFromJson(const Json& value) {
  return {PeekSigned(PeekAt(value, 0)), static_cast<uint32_t>(PeekUnsigned(PeekAt(value, 1)))};
}

bool HasSpace(const Json& spaces, const std::string& name, const Json& space) {
  const auto found = spaces.find(name);
  return found != spaces.end() && *found == space;
}

// Metadata without the label spaces that the nodes give again.
Json MetadataRest(const SparkGraph& graph, const GraphDelta& delta) {
  if (!graph.metadata.is_object()) return Json::object();
  Json rest = graph.metadata;
  if (!Peek(rest, kLabelSpaces).is_object()) return rest;
  std::map<NodeId, SparkLayerKey> keys;
  for (const SparkNode& node : graph.nodes) keys[NodeId(node.id)] = node.key;
  const Json made = LabelSpacesOf(delta.nodes, keys);
  Json& spaces = rest[kLabelSpaces];
  for (auto it = spaces.begin(); it != spaces.end();) {
    it = HasSpace(made, it.key(), it.value()) ? spaces.erase(it) : std::next(it);
  }
  if (spaces.empty()) rest.erase(kLabelSpaces);
  return rest;
}

Json RestOf(const SparkGraph& graph, const GraphDelta& delta) {
  std::set<SparkLayerKey> used;
  for (const SparkNode& node : graph.nodes) used.insert(node.key);
  const std::set<SparkLayerKey> listed(graph.layer_keys.begin(), graph.layer_keys.end());
  Json rest = Json::object();
  for (const SparkLayerKey& key : listed) {
    if (!used.contains(key)) rest["layer_keys"].push_back(KeyJson(key));
  }
  std::vector<SparkLayerKey> all(listed.begin(), listed.end());
  all.insert(all.end(), used.begin(), used.end());
  const auto standard = StandardLayerNames(all);
  for (const auto& [name, key] : graph.layer_names) {
    const auto found = standard.find(name);
    const bool is_made = found != standard.end() && found->second == key;
    if (!is_made) rest["layer_names"][name] = KeyJson(key);
  }
  Json metadata = MetadataRest(graph, delta);
  if (!metadata.empty()) rest["metadata"] = std::move(metadata);
  return rest;
}

void AddMetadata(const Json& kept, Json* metadata) {
  if (!kept.is_object()) return;
  if (!metadata->is_object()) *metadata = Json::object();
  for (const auto& [name, value] : kept.items()) {
    if (name != kLabelSpaces) (*metadata)[name] = value;
  }
  const Json& spaces = Peek(kept, kLabelSpaces);
  if (!spaces.is_object()) return;
  for (const auto& [name, space] : spaces.items()) {
    Json& made = (*metadata)[kLabelSpaces][name];
    if (!space.is_array()) {
      made = space;
      continue;
    }
    // The kept space first, then what nodes have beyond it.
    Json merged = space;
    for (const Json& label : made) {
      const bool is_known = std::any_of(space.begin(), space.end(), [&](const Json& known) {
        return PeekAt(known, 0) == PeekAt(label, 0);
      });
      if (!is_known) merged.push_back(label);
    }
    made = std::move(merged);
  }
}

}  // namespace

std::map<std::string, SparkLayerKey> StandardLayerNames(const std::vector<SparkLayerKey>& keys) {
  std::map<std::string, SparkLayerKey> names;
  for (const auto& [name, key] : AllStandardNames()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) names[name] = key;
  }
  return names;
}

Json LabelSpacesOf(const std::vector<Node>& nodes, const std::map<NodeId, SparkLayerKey>& keys) {
  std::map<SparkLayerKey, std::map<int32_t, std::string>> names;
  for (const Node& node : nodes) {
    const auto key = keys.find(node.id);
    if (key == keys.end() || node.class_id < 0 || node.class_name.empty()) continue;
    names[key->second].try_emplace(node.class_id, node.class_name);
  }
  Json spaces = Json::object();
  for (const auto& [key, labels] : names) {
    Json& space = spaces[absl::StrCat("_l", key.layer, "p", key.partition)];
    space = Json::array();
    for (const auto& [id, name] : labels) space.push_back({static_cast<uint32_t>(id), name});
  }
  return spaces;
}

bool KeepGraphRest(const SparkGraph& graph, GraphDelta* delta) {
  const Json rest = RestOf(graph, *delta);
  if (rest.empty()) return true;
  const SparkNode* keeper = nullptr;
  for (const SparkNode& node : graph.nodes) {
    const bool is_better = keeper == nullptr || node.key.layer > keeper->key.layer ||
                           (node.key.layer == keeper->key.layer && node.id < keeper->id);
    if (is_better && node.type != SparkClass::kAgent) keeper = &node;
  }
  if (keeper == nullptr) return false;
  // An export says itself what the attributes were.
  if (keeper->own.is_object()) return true;
  for (Node& node : delta->nodes) {
    if (node.id.value == keeper->id) return KeepText(kGraphRestAttribute, rest, &node.attributes);
  }
  return false;
}

void AddGraphRest(const std::vector<Node>& nodes, SparkGraph* graph) {
  std::set<SparkLayerKey> keys(graph->layer_keys.begin(), graph->layer_keys.end());
  for (const Node& node : nodes) {
    const Json rest = KeptText(kGraphRestAttribute, node.attributes);
    if (!rest.is_object()) continue;
    const Json& kept_keys = Peek(rest, "layer_keys");
    for (size_t i = 0; kept_keys.is_array() && i < kept_keys.size(); ++i) {
      keys.insert(KeyFromJson(kept_keys[i]));
    }
    const Json& kept_names = Peek(rest, "layer_names");
    if (kept_names.is_object()) {
      for (const auto& [name, key] : kept_names.items()) {
        graph->layer_names[name] = KeyFromJson(key);
      }
    }
    AddMetadata(Peek(rest, "metadata"), &graph->metadata);
  }
  graph->layer_keys.assign(keys.begin(), keys.end());
  for (const auto& [name, key] : StandardLayerNames(graph->layer_keys)) {
    graph->layer_names.try_emplace(name, key);
  }
}

}  // namespace dsg
