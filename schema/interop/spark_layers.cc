// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_layers.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "schema/interop/json_fields.h"

namespace dsg {
namespace {

constexpr int64_t kLayerMax = 1'000'000;
constexpr uint32_t kPartitionMax = 999;
constexpr size_t kLayerNameMax = 64;
constexpr int32_t kObjectsRank = 200;
constexpr int32_t kBuildingsRank = 500;

// Layers of a map that are layers of Spark-DSG too, with its names and, unless the map has layers
// in between, its numbers.
struct StandardLayer {
  LayerId layer;
  const char* name;
  int64_t number;
  // Imports put nodes of partitions up to this one into the layer.
  uint32_t partition_max = 0;
};
// The first of a number is where imports put nodes.
constexpr StandardLayer kStandardLayers[] = {
    {layers::kObjects, "OBJECTS", 2},
    {layers::kAgents, "OBJECTS", 2},
    // 3-D places, then 2-D places.
    {layers::kPlaces, "PLACES", 3, 1},
    {layers::kRooms, "ROOMS", 4},
    {layers::kBuildings, "BUILDINGS", 5},
};

// Names that Spark-DSG gives to layers which a map has no layer for.
constexpr std::pair<const char*, SparkLayerKey> kOtherNames[] = {
    {"SEGMENTS", {1, 0}}, {"AGENTS", {2, 0}}, {"MESH_PLACES", {3, 1}}};

const StandardLayer* FindStandard(LayerId layer) {
  for (const StandardLayer& standard : kStandardLayers) {
    if (standard.layer == layer) return &standard;
  }
  return nullptr;
}

const Layer* FindDefault(LayerId id) {
  for (const Layer& layer : DefaultLayers()) {
    if (layer.id == id) return &layer;
  }
  return nullptr;
}

const Layer* FindDefault(std::string_view name) {
  for (const Layer& layer : DefaultLayers()) {
    if (layer.name == name) return &layer;
  }
  return nullptr;
}

LayerId IdOfCustom(const SparkLayerKey& key) {
  return static_cast<LayerId>(1000 + 1000 * key.layer + key.partition);
}

// The kind of the things in a layer of the model; "" for other layers.
std::string KindOf(LayerId layer) {
  for (const kinds::Kind& kind : kinds::kAll) {
    if (kind.layer == layer && !kind.is_agent) return std::string(kind.name);
  }
  return "";
}

// Names no kind of the model, which would tie the node to the model's layer.
std::string CustomKind(SparkClass type) {
  std::string stem(NameOf(type));
  for (const char* ending : {"Attributes", "Node"}) {
    if (stem.ends_with(ending)) stem.resize(stem.size() - std::string_view(ending).size());
  }
  return stem.empty() ? "spark_node" : absl::StrCat("spark_", absl::AsciiStrToLower(stem));
}

// Rank to layer number, growing.
std::map<int32_t, int64_t> NumberRanks(const std::set<int32_t>& ranks) {
  std::map<int32_t, int64_t> numbers;
  int64_t last = kObjectsRank / 100 - 1;
  for (const int32_t rank : ranks) {
    if (rank < kObjectsRank) {
      numbers[rank] = std::max(0, rank / 100);
      continue;
    }
    last = std::max<int64_t>(last + 1, (int64_t{rank} + 99) / 100);
    numbers[rank] = last;
  }
  return numbers;
}

}  // namespace

SparkLayers::SparkLayers(const SparkGraph& graph) {
  std::set<std::string> taken = {"agent_poses"};
  for (const Layer& layer : DefaultLayers()) taken.insert(layer.name);
  for (const auto& [name, key] : graph.layer_names) {
    if (name.empty() || name.size() > kLayerNameMax || taken.contains(name)) continue;
    if (name.starts_with("layer_")) continue;
    names_.emplace(key, name);
  }
  ReadOwn(Peek(graph.own, "layers"));
}

// Entries that make no layer are passed over: the file then reads as a foreign one.
void SparkLayers::ReadOwn(const nlohmann::json& layers) {
  for (size_t i = 0; layers.is_array() && i < layers.size(); ++i) {
    const nlohmann::json& entry = layers[i];
    const nlohmann::json& name = Peek(entry, "name");
    const SparkLayerKey key = {PeekSigned(Peek(entry, "layer")),
                               static_cast<uint32_t>(PeekUnsigned(Peek(entry, "partition")))};
    const int64_t rank = PeekSigned(Peek(entry, "rank"));
    const bool is_layer = name.is_string() && !name.get_ref<const std::string&>().empty() &&
                          name.get_ref<const std::string&>().size() <= kLayerNameMax && rank > 0 &&
                          rank <= kLayerMax && key.layer >= 0 && key.layer <= kLayerMax &&
                          key.partition <= kPartitionMax;
    if (!is_layer) continue;
    const Layer layer = {IdOfCustom(key), name.get<std::string>(), static_cast<int32_t>(rank)};
    const Layer* const known = FindDefault(layer.name);
    own_[key] = known == nullptr ? layer : *known;
  }
}

std::string SparkLayers::NameOfCustom(const SparkLayerKey& key) const {
  const auto found = names_.find(key);
  if (found != names_.end()) return found->second;
  return absl::StrCat("layer_", key.layer, "_", key.partition);
}

std::optional<SparkPlacement> SparkLayers::Place(const SparkNode& node, Skips* skips) {
  const auto& [layer, partition] = node.key;
  if (layer < 0 || layer > kLayerMax || partition > kPartitionMax) {
    skips->Add(SkipKind::kNode, absl::StrCat("node ", ToString(NodeId(node.id))),
               absl::StrCat("layer ", layer, " partition ", partition, " is outside 0 to ",
                            kLayerMax, ", 0 to ", kPartitionMax));
    return std::nullopt;
  }
  const bool is_pose = node.type == SparkClass::kAgent;
  const auto own = own_.find(node.key);
  if (own != own_.end() && !is_pose) {
    const std::string kind = KindOf(own->second.id);
    if (kind.empty()) custom_[own->second.id] = own->second;
    return SparkPlacement{own->second, kind.empty() ? CustomKind(node.type) : kind};
  }
  if (is_pose && layer == 2) {
    const Layer poses = {kAgentPoseLayer, "agent_poses", 200};
    custom_[poses.id] = poses;
    return SparkPlacement{poses, kAgentPoseKind};
  }
  for (const StandardLayer& standard : kStandardLayers) {
    const bool is_it = !is_pose && layer == standard.number && partition <= standard.partition_max;
    if (is_it) return SparkPlacement{*FindDefault(standard.layer), KindOf(standard.layer)};
  }
  const Layer custom = {IdOfCustom(node.key), NameOfCustom(node.key),
                        static_cast<int32_t>(100 * layer)};
  custom_[custom.id] = custom;
  return SparkPlacement{custom, is_pose ? kAgentPoseKind : CustomKind(node.type)};
}

std::vector<Layer> SparkLayers::custom_layers() const {
  std::vector<Layer> all;
  for (const auto& [id, layer] : custom_) all.push_back(layer);
  return all;
}

SparkLayerKeys::SparkLayerKeys(const std::vector<Layer>& all, const std::vector<Node>& nodes) {
  std::set<LayerId> used;
  for (const Node& node : nodes) {
    if (node.kind != kAgentPoseKind) used.insert(node.layer);
  }
  std::set<int32_t> ranks;
  for (int32_t rank = kObjectsRank; rank <= kBuildingsRank; rank += 100) ranks.insert(rank);
  for (const Layer& layer : all) {
    if (!used.contains(layer.id)) continue;
    layers_[layer.id] = layer;
    ranks.insert(layer.rank);
  }
  const std::map<int32_t, int64_t> numbers = NumberRanks(ranks);
  // 3-D and 2-D places have the first two partitions of theirs.
  std::map<int64_t, uint32_t> next_partition;
  for (int32_t rank = kObjectsRank; rank <= kBuildingsRank; rank += 100) {
    next_partition[numbers.at(rank)] = rank == 300 ? 2 : 1;
  }
  for (const auto& [id, layer] : layers_) {
    const StandardLayer* standard = FindStandard(id);
    const int64_t number = numbers.at(layer.rank);
    keys_[id] = {number, standard != nullptr ? 0 : next_partition[number]++};
  }
}

SparkLayerKey SparkLayerKeys::KeyOf(const Node& node) const {
  if (node.kind == kAgentPoseKind) return {2, static_cast<uint32_t>(node.id.letter())};
  const auto found = keys_.find(node.layer);
  return found == keys_.end() ? SparkLayerKey{} : found->second;
}

nlohmann::json SparkLayerKeys::OwnLayers(const std::vector<SparkLayerKey>& used) const {
  nlohmann::json own = nlohmann::json::array();
  for (const auto& [id, layer] : layers_) {
    const SparkLayerKey& key = keys_.at(id);
    const StandardLayer* standard = FindStandard(id);
    // An import of any file gives other layers the file's name and the rank of their number.
    const bool is_known = standard != nullptr
                              ? key.layer == standard->number
                              : FindDefault(layer.name) == nullptr && layer.rank == 100 * key.layer;
    const bool is_used = std::find(used.begin(), used.end(), key) != used.end();
    if (is_known || !is_used) continue;
    own.push_back({{"name", layer.name},
                   {"rank", layer.rank},
                   {"layer", key.layer},
                   {"partition", key.partition}});
  }
  return own;
}

void SparkLayerKeys::AddStandardNames(SparkGraph* graph) const {
  for (const auto& [id, key] : keys_) {
    const StandardLayer* standard = FindStandard(id);
    if (standard != nullptr) graph->layer_names[standard->name] = key;
  }
}

void SparkLayerKeys::AddOtherNames(const std::vector<SparkLayerKey>& used,
                                   SparkGraph* graph) const {
  std::set<SparkLayerKey> named;
  for (const auto& [name, key] : graph->layer_names) named.insert(key);
  for (const auto& [id, layer] : layers_) {
    const SparkLayerKey& key = keys_.at(id);
    const bool is_used = std::find(used.begin(), used.end(), key) != used.end();
    // Imports name layers so that had no name.
    if (!is_used || named.contains(key) || layer.name.starts_with("layer_")) continue;
    const bool is_default = FindDefault(layer.name) != nullptr;
    graph->layer_names[is_default ? absl::AsciiStrToUpper(layer.name) : layer.name] = key;
  }
}

std::optional<SparkLayerKey> StandardKeyOf(const Node& node) {
  if (node.kind == kAgentPoseKind) {
    return SparkLayerKey{2, static_cast<uint32_t>(node.id.letter())};
  }
  const auto layer = LayerOfKind(node.kind);
  const StandardLayer* const standard = layer.has_value() ? FindStandard(*layer) : nullptr;
  if (standard == nullptr) return std::nullopt;
  return SparkLayerKey{standard->number, 0};
}

std::map<std::string, SparkLayerKey> StandardLayerNames(const std::vector<SparkLayerKey>& keys) {
  std::map<std::string, SparkLayerKey> names;
  const auto add = [&](const char* name, const SparkLayerKey& key) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) names[name] = key;
  };
  for (const StandardLayer& standard : kStandardLayers) add(standard.name, {standard.number, 0});
  for (const auto& [name, key] : kOtherNames) add(name, key);
  return names;
}

const char* SiblingRelation(LayerId layer) {
  if (layer == layers::kPlaces) return relations::kTraversable;
  if (layer == layers::kRooms) return relations::kAdjacent;
  return relations::kNear;
}

}  // namespace dsg
