// SPDX-License-Identifier: Apache-2.0
// Spark-DSG's JSON, versions 1.0.0 (without a header) to 1.1.3, into a SparkGraph.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// The object has the keys of a Spark-DSG mesh file: points or vertices beside faces, no nodes.
bool IsSparkJsonMesh(const nlohmann::json& root);

/// Reads a graph or a mesh file. Forms are told apart by the fields that are there, not by the
/// version that the header claims, because old files often carry none.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` and the field.
absl::StatusOr<SparkGraph> ReadSparkJson(nlohmann::json root, const std::string& file);

}  // namespace dsg
