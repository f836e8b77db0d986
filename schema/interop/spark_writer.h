// SPDX-License-Identifier: Apache-2.0
// A Spark-DSG graph into the bytes of kSparkVersionNewest, JSON or binary. map_to_spark.h chooses
// what is in it.
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
/// where these are null. Numbers that JSON has no text for become null, which readers of the format
/// take for not-a-number. The binary form writes a default where a field has another shape than the
/// format, and has no place for fields that the format does not know. Equal graphs, equal bytes.
/// Errors: those of `sink`.
absl::Status WriteSpark(const SparkGraph& graph, SparkForm form, const ByteSink& sink);

/// The same in one piece.
std::string SparkToBytes(const SparkGraph& graph, SparkForm form);

}  // namespace dsg
