// SPDX-License-Identifier: Apache-2.0
// Spark-DSG's binary form, versions 1.0.2 to 1.1.3, into a SparkGraph.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// The bytes begin with a type byte that only the binary form begins with. True also for files
/// older than the header, so that reading one explains what to do.
bool LooksLikeSparkBinary(std::string_view bytes);

/// Reads a graph or a mesh file, to the last byte.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` and the byte offset; also for versions
/// before 1.0.2 (fields not known) and after 1.1.3 (the form does not say how long a field is, so
/// one unknown field hides all that follow).
absl::StatusOr<SparkGraph> ReadSparkBinary(std::string_view bytes, const std::string& file);

}  // namespace dsg
