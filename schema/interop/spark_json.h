// SPDX-License-Identifier: Apache-2.0
// Spark-DSG's JSON, versions 1.0.0 (without a header) to 1.1.3, into a SparkGraph.
// Nodes and edges are read one after the other: as one tree a file takes ten times its size.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// A value that has not been read yet, and where in the file it begins.
struct JsonText {
  std::string_view text;
  size_t offset = 0;
};

/// Of one object, by key.
using JsonMembers = std::map<std::string, JsonText>;

/// Called with text that has been read and will not be read again; may be null.
using PassedText = std::function<void(std::string_view)>;

/// The members of the object that `text` is; that their values are sound is for who reads them to
/// find. Errors: as JsonCursor; FILE_MALFORMED too if the text is no object.
absl::StatusOr<JsonMembers> SplitJson(std::string_view text, const std::string& file);

/// They are those of a Spark-DSG mesh file: points or vertices beside faces, no nodes.
bool IsSparkJsonMesh(const JsonMembers& members);

/// Reads a graph or a mesh file. Forms are told apart by the fields that are there, not by the
/// version that the header claims, because old files often carry none. Single nodes, edges and
/// fields that cannot be read are counted in the graph's `skips`; fields of nodes are packed.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` and the field, or as JsonCursor.
absl::StatusOr<SparkGraph> ReadSparkJson(const JsonMembers& members, const std::string& file,
                                         const PassedText& passed = nullptr);

}  // namespace dsg
