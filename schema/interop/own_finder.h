// SPDX-License-Identifier: Apache-2.0
// What an export lacks: the graph is imported again, and what comes out wrong goes into its
// metadata. Refuses to guess what a reader makes of a field; it asks the reader.
#pragma once

#include "absl/status/status.h"
#include "schema/interop/map_to_spark.h"

namespace dsg {

/// Sets `own` of nodes, edges and graph, so that an import of `graph` gives the nodes and edges of
/// `map` again. Errors: of SparkToDelta.
absl::Status FindOwnParts(const MapContents& map, SparkGraph* graph);

}  // namespace dsg
