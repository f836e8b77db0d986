// SPDX-License-Identifier: Apache-2.0
#include "ingest/correction/correction.h"

#include <algorithm>
#include <utility>

#include "ingest/correction/map_mover.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

void CorrectAgent(ToldAgent agent, const TrajectoryChange& change, const MovePosesOptions& options,
                  GraphDelta* delta) {
  if (agent.poses.empty()) return;
  std::vector<TimedPose> poses = MovePoses(std::move(agent.poses), change, options);
  // An agent's node stands where its track ends.
  agent.node.map_T_node = poses.back().map_T_agent;
  delta->corrections.push_back(
      {agent.node.id, poses.front().time_ns, poses.back().time_ns + 1, std::move(poses)});
  delta->nodes.push_back(std::move(agent.node));
}

}  // namespace

LoopClosure ToLoopClosure(const LoopMeasurement& loop) {
  return {.from_ns = loop.from_ns,
          .to_ns = loop.time_ns,
          .from_T_to = loop.from_T_to,
          .information = loop.information,
          .origin = loop.origin};
}

Correction MakeCorrection(ToldMap told, const RobotGraph::Solution& solution) {
  Correction correction;
  const TrajectoryChange& change = solution.change;
  if (change.IsIdentity()) {
    correction.layers = std::move(told.layers);
    return correction;
  }
  MovedMesh mesh = MoveMesh(told.mesh, change, told.mesh_block_size_m);
  correction.layers = MoveGraph(std::move(told.layers), change, mesh.shift, told.robot.poses);
  GraphDelta& delta = correction.delta;
  delta.nodes = correction.layers.nodes;
  delta.mesh_blocks = std::move(mesh.blocks);
  delta.mesh_removals = std::move(mesh.removed);
  CorrectAgent(std::move(told.robot), change,
               {.keyframe_times = solution.keyframe_times, .covariances = solution.covariances},
               &delta);
  for (ToldAgent& person : told.people) {
    CorrectAgent(std::move(person), change, {.is_kept_upright = true}, &delta);
  }
  Coalesce(&delta);
  return correction;
}

}  // namespace dsg::ingest
