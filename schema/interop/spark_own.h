// SPDX-License-Identifier: Apache-2.0
// What Spark-DSG has no words for, in the metadata of exports: the fields of a node or edge that an
// import of the rest of the file would get wrong, in the protobuf JSON of dsg.v1.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_layers.h"
#include "schema/model/edge.h"
#include "schema/model/graph_delta.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"

namespace dsg {

/// One object a node or edge, in order, without revisions. Layers are named, so `layers` must hold
/// those that the map added.
std::vector<nlohmann::json> NodesToJson(const std::vector<Node>& nodes,
                                        const std::vector<Layer>& layers);
std::vector<nlohmann::json> EdgesToJson(const std::vector<Edge>& edges);

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED and those of the conversion from protobuf.
absl::StatusOr<std::vector<Node>> NodesFromJson(const std::vector<nlohmann::json>& nodes,
                                                const std::vector<Layer>& layers);
absl::StatusOr<std::vector<Edge>> EdgesFromJson(const std::vector<nlohmann::json>& edges);

/// What turns `from` into `to`: fields with their values, null for those to remove; null if equal.
nlohmann::json Patch(const nlohmann::json& from, const nlohmann::json& to);
/// `id` stays as it is.
void ApplyPatch(const nlohmann::json& patch, nlohmann::json* node);

/// Nodes and edges become what the metadata says they were; people get their tracks back, robots
/// their names, and poses that were no nodes of the map go. `delta` is the whole graph as
/// converted; edges that name nodes it does not have are counted in `skips`. Errors:
/// INVALID_ARGUMENT/FILE_MALFORMED naming `file` and what was wrong.
absl::Status TakeOwnParts(const SparkGraph& graph, const SparkLayers& layers,
                          const std::string& file, Skips* skips, GraphDelta* delta);

}  // namespace dsg
