// SPDX-License-Identifier: Apache-2.0
// The free-form JSON that Spark-DSG hangs on graphs, nodes and edges, in both of its forms.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "schema/interop/spark_graph.h"

namespace dsg {

/// The text to keep: "" for null and for {}.
std::string MetadataText(const nlohmann::json& metadata);

/// Takes the label spaces ("labelspaces": {"_l2p0": [[0, "chair"], ...]}). What is free-form cannot
/// be malformed: keys that are not understood end up in the graph's notes.
void ReadGraphMetadata(const nlohmann::json& metadata, SparkGraph* graph);

}  // namespace dsg
