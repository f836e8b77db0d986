// SPDX-License-Identifier: Apache-2.0
// The JSON form of a Spark-DSG graph. Refuses numbers that JSON has no text for: they become null,
// which readers of the format take for "not a number".
#pragma once

#include "schema/interop/spark_writer.h"

namespace dsg {

absl::Status WriteSparkAsJson(const SparkGraph& graph, const ByteSink& sink);

}  // namespace dsg
