// SPDX-License-Identifier: Apache-2.0
// One node of a map as Spark-DSG would have it, as far as the format has words for it.
// Refuses to choose ids of layers, which depend on the whole map.
#pragma once

#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_layers.h"
#include "schema/model/node.h"

namespace dsg {

/// The class for a node that does not remember one. Things whose validity begins or ends are
/// Khronos objects, which have presence; so are humans, whose viewer shows their ways.
SparkClass ClassFor(const Node& node);

/// Where a standard layer, or a pose, is in Spark-DSG; nullopt for layers of the map's own.
std::optional<SparkLayerKey> KeyFor(const Node& node);

/// Pose, box, name, class, times and components in the format's terms; `fields` stays null.
SparkNode ToSpark(const Node& node, SparkClass type, SparkLayerKey key);

}  // namespace dsg
