// SPDX-License-Identifier: Apache-2.0
// The binary form of a Spark-DSG graph. Refuses fields that the format does not know, since the
// form has no place for them.
#pragma once

#include "schema/interop/spark_writer.h"

namespace dsg {

absl::Status WriteSparkAsBinary(const SparkGraph& graph, const ByteSink& sink);

}  // namespace dsg
