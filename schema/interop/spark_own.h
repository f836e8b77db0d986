// SPDX-License-Identifier: Apache-2.0
// What Spark-DSG has no words for, as the metadata of exports: the fields of a node or edge that an
// import of the rest of the file would get wrong, in the protobuf JSON of dsg.v1.
// Refuses to describe what the file says already.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/edge.h"
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

}  // namespace dsg
