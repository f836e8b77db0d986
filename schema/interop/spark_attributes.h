// SPDX-License-Identifier: Apache-2.0
// The attributes of one Spark-DSG node, from their JSON form of any version.
// Fields of the wrong type or range are errors; missing ones are what the format says they are
// then.
#pragma once

#include <string>

#include "schema/interop/json_fields.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// Fills the members of `node`, whose id and type are set, but not its `fields`. Errors go to
/// `source`.
void ReadSparkAttributes(const JsonFields& attributes, JsonSource* source, SparkNode* node);

/// The same, but a field that cannot be read is taken out of `attributes` and counted in `skips`.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED when the position cannot be read, or if these are no
/// attributes.
absl::Status ReadWhatCanBeRead(const std::string& file, const std::string& where,
                               nlohmann::json* attributes, Skips* skips, SparkNode* node);

/// The class that `attributes` name. Of one that is not known, as programs can register their own,
/// the fields are read that each node has, and those of semantic nodes if it looks like one.
SparkClass ReadSparkClass(const std::string& where, const nlohmann::json& attributes, Skips* skips);

}  // namespace dsg
