// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/correction.h"

#include <algorithm>
#include <utility>

#include "ingest/pipeline/delta_size.h"
#include "ingest/pipeline/map_mover.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

// So many poses with covariance are about 1 MiB as a message.
constexpr size_t kPosesPerPiece = 5000;

// Pieces that follow each other without a gap.
void AddPieces(TrajectoryCorrection whole, std::vector<TrajectoryCorrection>* pieces) {
  const std::vector<TimedPose>& poses = whole.poses;
  for (size_t begin = 0; begin < poses.size(); begin += kPosesPerPiece) {
    const size_t end = std::min(poses.size(), begin + kPosesPerPiece);
    TrajectoryCorrection& piece = pieces->emplace_back();
    piece.agent = whole.agent;
    piece.from_ns = begin == 0 ? whole.from_ns : poses[begin].time_ns;
    piece.to_ns = end == poses.size() ? whole.to_ns : poses[end].time_ns;
    piece.poses.assign(poses.begin() + static_cast<std::ptrdiff_t>(begin),
                       poses.begin() + static_cast<std::ptrdiff_t>(end));
  }
}

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

std::vector<GraphDelta> CutCorrection(GraphDelta delta) {
  std::vector<GraphDelta> parts;
  if (EstimateBytes(delta) <= kDeltaBytesMax) {
    parts.push_back(std::move(delta));
    return parts;
  }
  GraphDelta rest;
  for (TrajectoryCorrection& track : delta.corrections) {
    AddPieces(std::move(track), &rest.corrections);
  }
  delta.corrections.clear();
  rest.mesh_blocks = std::exchange(delta.mesh_blocks, {});
  parts.push_back(std::move(delta));
  for (GraphDelta& part : SplitToSize(std::move(rest))) parts.push_back(std::move(part));
  return parts;
}

}  // namespace dsg::ingest
