// SPDX-License-Identifier: Apache-2.0
// What a Spark-DSG node says and a node of a map has no field for, kept with the node as attributes
// of its own, so that a graph can be written back whole and a forgotten node leaves nothing behind.
// Refuses to override what has changed since: a kept field holds only as long as what the map says
// in its stead is what it was.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "schema/interop/spark_graph.h"
#include "schema/model/node.h"

namespace dsg {

/// Names of the attributes: this, and with _2, _3, ... behind it for long rests.
inline constexpr char kRestAttribute[] = "spark_dsg";
/// The rest of the graph as a whole, on one of its nodes.
inline constexpr char kGraphRestAttribute[] = "spark_dsg_graph";

/// Compares what was read (the fields: SparseFieldsOf) with what an export of `node` would write,
/// and keeps the difference in its attributes: none if there is none. `keep_key`: the layer too,
/// since no layer of the map says it. False if the difference is too long to keep.
bool KeepRest(const SparkNode& read, const nlohmann::json& sparse_fields, bool keep_key,
              Node* node);

/// The node as Spark-DSG, with what KeepRest kept. `fallback`: its layer if nothing was kept of it.
SparkNode ToSparkWithRest(const Node& node, const SparkLayerKey& fallback);

/// Any JSON as text attributes; false, and none, if it is too long.
bool KeepText(const char* name, const nlohmann::json& value, Attributes* attributes);
/// Null if there is none, or if it is broken.
nlohmann::json KeptText(const char* name, const Attributes& attributes);

}  // namespace dsg
