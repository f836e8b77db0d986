// SPDX-License-Identifier: Apache-2.0
// A Spark-DSG graph as one delta of a map.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/interop/scene_graph_file.h"
#include "schema/interop/spark_graph.h"

namespace dsg {

/// Every node keeps its id; every edge becomes exactly one edge, from parent to child between
/// layers and from the lower to the higher id within one. What no map can hold (edges that lead
/// nowhere, a second node of one id, numbers that are not finite) is skipped and counted.
///
/// A robot's poses are in the file as nodes. They are kept as such (kind "agent_pose", layer
/// "agent_poses"), so that a graph can be written back whole, and again as the robot's trajectory,
/// which is what queries about agents read.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `file` for what an export of ours wrote into the
/// metadata and that has been changed since.
absl::StatusOr<ImportedGraph> SparkToDelta(SparkGraph graph, const std::string& file,
                                           double mesh_block_size_m);

}  // namespace dsg
