// SPDX-License-Identifier: Apache-2.0
// Where the layers of a Spark-DSG file go in a map.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/agent_pose.h"

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

}  // namespace dsg
