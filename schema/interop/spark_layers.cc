// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_layers.h"

#include <algorithm>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "schema/interop/json_peek.h"

namespace dsg {
namespace {

constexpr int64_t kLayerMax = 1'000'000;
constexpr uint32_t kPartitionMax = 999;
constexpr size_t kLayerNameMax = 64;

const Layer& DefaultLayer(LayerId id) {
  const auto& defaults = DefaultLayers();
  return *std::find_if(defaults.begin(), defaults.end(),
                       [id](const Layer& layer) { return layer.id == id; });
}

LayerId IdOfCustom(const SparkLayerKey& key) {
  return static_cast<LayerId>(1000 + 1000 * key.layer + key.partition);
}

// The kind of the nodes of a standard layer; "" for others.
std::string KindOf(LayerId layer) {
  for (const char* kind :
       {kinds::kObject, kinds::kPlace, kinds::kStructure, kinds::kRoom, kinds::kBuilding}) {
    if (LayerOfKind(kind) == layer) return kind;
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
    Layer layer = {IdOfCustom(key), name.get<std::string>(), static_cast<int32_t>(rank)};
    for (const Layer& standard : DefaultLayers()) {
      if (standard.name == layer.name) layer = standard;
    }
    own_[key] = layer;
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
  if (!is_pose && layer == 2 && partition == 0) {
    return SparkPlacement{DefaultLayer(layers::kObjects), kinds::kObject};
  }
  if (!is_pose && layer == 3 && partition <= 1) {
    return SparkPlacement{DefaultLayer(layers::kPlaces), kinds::kPlace};
  }
  if (!is_pose && layer == 4 && partition == 0) {
    return SparkPlacement{DefaultLayer(layers::kRooms), kinds::kRoom};
  }
  if (!is_pose && layer == 5 && partition == 0) {
    return SparkPlacement{DefaultLayer(layers::kBuildings), kinds::kBuilding};
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

}  // namespace dsg
