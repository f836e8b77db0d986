// SPDX-License-Identifier: Apache-2.0
// One change of the map after loop closures: all that a session told, moved.
// Refuses to commit, and to find loop closures.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/graph_told.h"
#include "ingest/log/log_source.h"
#include "ingest/loop/robot_graph.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

LoopClosure ToLoopClosure(const LoopMeasurement& loop);

/// An agent as the session told it: its node, and its poses in the map of before.
struct ToldAgent {
  Node node;
  std::vector<TimedPose> poses;
};

struct ToldMap {
  LayerGraph layers;
  std::vector<const MeshBlock*> mesh;
  ToldAgent robot;
  std::vector<ToldAgent> people;
  double mesh_block_size_m = 2.0;
};

struct Correction {
  /// Nodes of all layers that moved, mesh blocks and blocks that vanished, one TrajectoryCorrection
  /// for each agent. Coalesced; without factors, which are told whether or not anything moved.
  GraphDelta delta;
  /// The layers after the move, for GraphTold::Tell.
  LayerGraph layers;
};

/// Everything that hung on keyframes that `solution` moved. Stays keep their times, places and
/// rooms. Empty when nothing moved.
Correction MakeCorrection(ToldMap told, const RobotGraph::Solution& solution);

}  // namespace dsg::ingest
