// SPDX-License-Identifier: Apache-2.0
// Spark-DSG graphs into the bytes of kSparkVersionNewest, JSON or binary.
// Refuses to choose what is in them: that is map_to_spark.h.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

enum class SparkForm { kJson, kBinary };

/// Takes the next bytes of a file.
using ByteSink = std::function<absl::Status(std::string_view)>;

/// Writes `graph` piece by piece. Nodes are written from their `fields`, or from their members
/// where these are null; of what is no number, time or list of the format a default is written. The
/// binary form has no place for fields that the format does not know. Equal graphs, equal bytes.
/// Errors: those of `sink`.
absl::Status WriteSpark(const SparkGraph& graph, SparkForm form, const ByteSink& sink);

/// The same in one piece.
std::string SparkToBytes(const SparkGraph& graph, SparkForm form);

/// The metadata of an edge or graph as JSON; an object also when the text is none.
nlohmann::json MetadataJson(const std::string& text);

/// Metadata with our own part in it; an object also when `metadata` is none.
nlohmann::json WithOwn(nlohmann::json metadata, const nlohmann::json& own);

}  // namespace dsg
