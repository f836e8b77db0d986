// SPDX-License-Identifier: Apache-2.0
// The part of export that writes Spark-DSG files.
// Refuses to leave half a file, and to write over one that may not be replaced.
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "absl/status/statusor.h"
#include "query/cli/export/map_content.h"
#include "query/cli/options_maps.h"
#include "query/cli/written.h"
#include "schema/interop/spark_writer.h"

namespace dsg::cli {

/// By the ending of the name: .json; .sparkdsg or .bin.
std::optional<SparkForm> SparkFormOf(const std::string& path);

/// `content` has poses and mesh; notes and progress go to `progress`.
/// Errors: of MapToSpark and AtomicFile.
absl::StatusOr<Written> WriteSparkExport(MapContent content, const ExportVerb& verb,
                                         std::ostream* progress);

}  // namespace dsg::cli
