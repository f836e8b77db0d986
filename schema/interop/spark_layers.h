// SPDX-License-Identifier: Apache-2.0
// Layers of Spark-DSG and of a map, in both directions.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/node.h"

namespace dsg {

/// Where a node goes.
struct SparkPlacement {
  Layer layer;
  std::string kind;
};

/// Layers 2 to 5 are the map's own objects, places (3-D and 2-D), rooms and buildings. Agents'
/// poses of layer 2 go to "agent_poses". All others become custom layers: id 1000 + 1000 x layer +
/// partition, so that the same layer of two files is one layer; rank 100 x layer, so that every
/// edge between layers of the file is a containment of the map; the file's name for the layer.
/// An export of a map says itself which of the map's layers its layers are.
class SparkLayers {
 public:
  explicit SparkLayers(const SparkGraph& graph);

  /// nullopt, counted in `skips`, when the key is outside what ids can express.
  std::optional<SparkPlacement> Place(const SparkNode& node, Skips* skips);

  /// The layers that an export of a map has besides the standard ones.
  const std::map<SparkLayerKey, Layer>& own_layers() const { return own_; }
  /// The custom layers that Place has returned so far, by id.
  std::vector<Layer> custom_layers() const;

 private:
  std::string NameOfCustom(const SparkLayerKey& key) const;
  void ReadOwn(const nlohmann::json& layers);

  std::map<SparkLayerKey, std::string> names_;
  std::map<SparkLayerKey, Layer> own_;
  std::map<LayerId, Layer> custom_;
};

/// Where the layers of a map go in a Spark-DSG file: 2 objects, 3 places, 4 rooms, 5 buildings.
/// Their order stays: where a map has a layer between two of these, the ones above it move up, and
/// their names tell.
class SparkLayerKeys {
 public:
  /// Only layers that have nodes count.
  SparkLayerKeys(const std::vector<Layer>& layers, const std::vector<Node>& nodes);

  SparkLayerKey KeyOf(const Node& node) const;

  /// For the metadata: [{"name", "rank", "layer", "partition"}] of those of `used` that an import
  /// could not tell by itself.
  nlohmann::json OwnLayers(const std::vector<SparkLayerKey>& used) const;
  void AddStandardNames(SparkGraph* graph) const;
  /// Names those of `used` that have no name yet.
  void AddOtherNames(const std::vector<SparkLayerKey>& used, SparkGraph* graph) const;

 private:
  std::map<LayerId, Layer> layers_;
  std::map<LayerId, SparkLayerKey> keys_;
};

/// Where nodes of the model's kinds, and poses, are in Spark-DSG; nullopt for others.
std::optional<SparkLayerKey> StandardKeyOf(const Node& node);

/// "OBJECTS" and the like, of those layers that are among `keys`.
std::map<std::string, SparkLayerKey> StandardLayerNames(const std::vector<SparkLayerKey>& keys);

/// What an edge between two nodes of a layer means in files that do not name it.
const char* SiblingRelation(LayerId layer);

}  // namespace dsg
