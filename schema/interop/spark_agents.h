// SPDX-License-Identifier: Apache-2.0
// The poses of a Spark-DSG file as robots with trajectories and stays.
#pragma once

#include <string>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/graph_delta.h"

namespace dsg {

/// A pose edge that leads to the nearest place is NEAREST_PLACE; one to any other layer is this.
inline constexpr char kPoseIn[] = "POSE_IN";

/// Attribute of a robot whose poses are also nodes: the letter of these.
inline constexpr char kPosesAttribute[] = "spark_dsg_poses";

/// Poses of one robot further apart than this are no stay; the default gap of a map.
inline constexpr TimeNs kStayGapNs = 2 * kNsPerSecond;

/// Adds to `delta`, which holds the converted nodes and edges, one robot for each letter of pose
/// ids: r0 for a, r1 for b and so on, or the next id that is free; named by the letter. Its track
/// has the poses with a time, in order of their ids; of equal or backward times the first stays.
/// Its stays follow the poses' places: a stay ends when the next begins, or right after its last
/// pose when the robot is lost for longer than kStayGapNs; stays are cut at kStayNsMax.
/// Sentences about what was left out are appended to `notes`.
void AddSparkAgents(const SparkGraph& graph, GraphDelta* delta, std::vector<std::string>* notes);

}  // namespace dsg
