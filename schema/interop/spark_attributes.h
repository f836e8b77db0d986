// SPDX-License-Identifier: Apache-2.0
// The attributes of one Spark-DSG node, from their JSON form of any version.
// Refuses fields of the wrong type or range; missing ones are what the format says they are then.
#pragma once

#include "schema/interop/json_fields.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// Fills the members of `node`, whose id and type are set, but not its `fields`; counts lists that
/// members keep as lengths in `graph`. Errors go to `source`.
void ReadSparkAttributes(const JsonFields& attributes, JsonSource* source, SparkGraph* graph,
                         SparkNode* node);

}  // namespace dsg
