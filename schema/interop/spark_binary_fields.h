// SPDX-License-Identifier: Apache-2.0
// Attributes and meshes from the bytes of a Spark-DSG binary file.
// Refuses to interpret them: attributes come out as the JSON that the format has for them.
#pragma once

#include <nlohmann/json.hpp>

#include "schema/interop/spark_byte_reader.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// The fields of a class in the order of `version`, without "type" and "metadata". After an error
/// of `in` what comes out is worthless.
nlohmann::json ReadBinaryFields(SparkClass type, const SparkVersion& version, SparkByteReader* in);

/// A mesh without a header.
MeshBlock ReadBinaryMesh(SparkByteReader* in);

}  // namespace dsg
