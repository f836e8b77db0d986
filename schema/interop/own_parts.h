// SPDX-License-Identifier: Apache-2.0
// Takes in what an export of a map has put into the metadata of a Spark-DSG file.
// Refuses metadata that is no part of a node or edge; a file without any is left as it is.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_layers.h"
#include "schema/model/graph_delta.h"

namespace dsg {

/// Nodes and edges become what the metadata says they were; people get their tracks back, robots
/// their names, and poses that were no nodes of the map go. `delta` is the whole graph as
/// converted; edges that name nodes it does not have are counted in `skips`. Errors:
/// INVALID_ARGUMENT/FILE_MALFORMED naming `file` and what was wrong.
absl::Status TakeOwnParts(const SparkGraph& graph, const SparkLayers& layers,
                          const std::string& file, Skips* skips, GraphDelta* delta);

}  // namespace dsg
