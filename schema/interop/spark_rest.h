// SPDX-License-Identifier: Apache-2.0
// What Spark-DSG says and a map has no field for, kept in attributes of nodes, so that a graph can
// be written back whole and a forgotten node leaves nothing behind. A kept field holds only while
// the map says what it said when the field was kept.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/graph_delta.h"
#include "schema/model/node.h"

namespace dsg {

/// Compares what was read (the fields: SparseFieldsOf) with what an export of `node` would write,
/// and keeps the difference, if any, in its attribute kSparkRest. `keep_key`: the layer too, since
/// no layer of the map says it. False if the difference is too long to keep.
bool KeepRest(const SparkNode& read, const nlohmann::json& sparse_fields, bool keep_key,
              Node* node);

/// The node as Spark-DSG, with what KeepRest kept. `fallback`: its layer if nothing was kept of it.
SparkNode ToSparkWithRest(const Node& node, const SparkLayerKey& fallback);

/// Any JSON as a text attribute, or as several with _2, _3, ... behind the name; false, and none,
/// if it is too long.
bool KeepText(const char* name, const nlohmann::json& value, Attributes* attributes);
/// Null if there is none, or if it is broken.
nlohmann::json KeptText(const char* name, const Attributes& attributes);

/// The names of classes that the nodes of each layer use; in the form of the graph's metadata.
nlohmann::json LabelSpacesOf(const std::vector<Node>& nodes,
                             const std::map<NodeId, SparkLayerKey>& keys);

/// Keeps names of layers, empty layers and metadata of the whole graph in attribute kSparkGraphRest
/// of the node of the highest layer and lowest id; not what an export makes anew from the nodes.
/// False if it is too long, or if there is no node.
bool KeepGraphRest(const SparkGraph& graph, GraphDelta* delta);

/// Adds the kept rests of the nodes, if any, to what is made from the map.
void AddGraphRest(const std::vector<Node>& nodes, SparkGraph* graph);

}  // namespace dsg
