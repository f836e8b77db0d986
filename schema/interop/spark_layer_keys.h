// SPDX-License-Identifier: Apache-2.0
// Where the layers of a map go in a Spark-DSG file: 2 objects, 3 places, 4 rooms, 5 buildings.
// Refuses to break their order: where a map has a layer between two of these, the ones above it
// move up, and their names tell.
#pragma once

#include <map>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/node.h"

namespace dsg {

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

}  // namespace dsg
