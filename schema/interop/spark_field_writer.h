// SPDX-License-Identifier: Apache-2.0
// One field of a Spark-DSG node in the binary form, from its JSON.
// Refuses nothing: of what has another shape a default is written.
#pragma once

#include <nlohmann/json.hpp>

#include "schema/interop/spark_byte_writer.h"
#include "schema/interop/spark_fields.h"

namespace dsg {

void WriteSparkField(SparkFieldType type, const nlohmann::json& value, SparkByteWriter* out);

}  // namespace dsg
