// SPDX-License-Identifier: Apache-2.0
// A map, at one instant of one revision, as a Spark-DSG graph. Nothing is lost in silence: what the
// format has no words for goes into metadata, or is counted in a note.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/interop/spark_graph.h"
#include "schema/model/graph_delta.h"
#include "schema/model/trajectory.h"

namespace dsg {

/// All of a map that an export reads.
struct MapContents {
  MapSpec spec;
  Revision revision = 0;
  /// Those of the nodes; ids of layers that the map added only tell layers apart.
  std::vector<Layer> layers;
  std::vector<Node> nodes;
  /// Both ends are among the nodes.
  std::vector<Edge> edges;
  /// Of agents among the nodes.
  std::vector<TrajectoryAppend> tracks;
  std::vector<MeshBlock> mesh;
};

struct SparkExport {
  SparkGraph graph;
  /// Of robots, written as nodes.
  int64_t pose_count = 0;
  /// Sentences for the user about what the file lacks.
  std::vector<std::string> notes;
};

/// Which poses of a track are written: nodes are dear. The ends of a track and of its gaps always
/// are.
struct PoseStep {
  /// A pose this far from the last one kept is kept; 0 = every pose.
  double distance_m = 0.5;
  /// And one this much later.
  TimeNs time_ns = kNsPerSecond;
};

/// Objects, places, rooms and buildings have the classes of the format; structures, levels and
/// other layers are semantic nodes. Poses of robots become nodes of a partition of their own with
/// edges to the one before and to the nearest place; people become Khronos objects with their ways.
/// What came from a Spark-DSG file goes back as it was, if nothing changed it since. An import of
/// the file makes the same nodes and edges again; tracks are as thin as `step` leaves them.
/// Errors: FAILED_PRECONDITION when nodes have no place in the format (negative ranks).
absl::StatusOr<SparkExport> MapToSpark(const MapContents& map, const PoseStep& step);

}  // namespace dsg
