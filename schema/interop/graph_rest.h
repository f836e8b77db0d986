// SPDX-License-Identifier: Apache-2.0
// Names of layers, empty layers and metadata of a whole Spark-DSG graph, kept through a map.
// Refuses to keep what an export makes anew from the nodes.
#pragma once

#include <map>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/graph_delta.h"

namespace dsg {

/// "OBJECTS" and the like, of those layers that are among `keys`.
std::map<std::string, SparkLayerKey> StandardLayerNames(const std::vector<SparkLayerKey>& keys);

/// The names of classes that the nodes of each layer use; in the form of the graph's metadata.
nlohmann::json LabelSpacesOf(const std::vector<Node>& nodes,
                             const std::map<NodeId, SparkLayerKey>& keys);

/// Keeps what is left over with the node of the highest layer and lowest id. False if it is too
/// long, or if there is no node.
bool KeepGraphRest(const SparkGraph& graph, GraphDelta* delta);

/// Adds the kept rests of the nodes, if any, to what is made from the map.
void AddGraphRest(const std::vector<Node>& nodes, SparkGraph* graph);

}  // namespace dsg
