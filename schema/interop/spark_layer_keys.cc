// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_layer_keys.h"

#include <algorithm>
#include <optional>
#include <set>

#include "absl/strings/ascii.h"
#include "schema/interop/spark_layers.h"

namespace dsg {
namespace {

constexpr int32_t kObjectsRank = 200;
constexpr int32_t kBuildingsRank = 500;

// Layers whose nodes Spark-DSG has layers of its own for, by its names and, unless the map has
// layers in between, its numbers.
struct Standard {
  LayerId layer;
  const char* name;
  int64_t number;
};
constexpr Standard kStandard[] = {{layers::kObjects, "OBJECTS", 2},
                                  {layers::kAgents, "OBJECTS", 2},
                                  {layers::kPlaces, "PLACES", 3},
                                  {layers::kRooms, "ROOMS", 4},
                                  {layers::kBuildings, "BUILDINGS", 5}};

const Standard* FindStandard(LayerId layer) {
  for (const Standard& standard : kStandard) {
    if (standard.layer == layer) return &standard;
  }
  return nullptr;
}

bool IsDefault(const Layer& layer) {
  const auto& defaults = DefaultLayers();
  return std::any_of(defaults.begin(), defaults.end(),
                     [&](const Layer& other) { return other.name == layer.name; });
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
    const Standard* standard = FindStandard(id);
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
    const Standard* standard = FindStandard(id);
    // An import of any file gives other layers the file's name and the rank of their number.
    const bool is_known = standard != nullptr ? key.layer == standard->number
                                              : !IsDefault(layer) && layer.rank == 100 * key.layer;
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
    const Standard* standard = FindStandard(id);
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
    graph->layer_names[IsDefault(layer) ? absl::AsciiStrToUpper(layer.name) : layer.name] = key;
  }
}

}  // namespace dsg
