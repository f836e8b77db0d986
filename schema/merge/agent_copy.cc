// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/agent_copy.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "schema/base/status.h"
#include "schema/merge/transform_node.h"

namespace dsg::merge {
namespace {

// Shapes may have thousands of vertices.
constexpr size_t kShapesADelta = 64;

using FactorKey = std::tuple<std::string, TimeNs, TimeNs, NodeId>;

FactorKey KeyOf(const PoseFactor& factor) {
  return {factor.type, factor.from_ns, factor.to_ns, factor.to_agent};
}

}  // namespace

AgentCopy::AgentCopy(const Snapshot& into, const Snapshot& other, const MergePlan& plan,
                     NodeId theirs, NodeId mine)
    : into_(into), other_(other), plan_(plan), theirs_(theirs), mine_(mine) {}

NodeId AgentCopy::Mapped(NodeId theirs_id) const {
  const auto found = plan_.node_ids.find(theirs_id);
  return found == plan_.node_ids.end() ? NodeId() : found->second;
}

std::vector<Sha256> AgentCopy::TakeTopologies() { return std::move(topologies_); }

absl::Status AgentCopy::Begin(const StopCheck& stop) {
  const absl::StatusOr<TrackInfo> track = into_.GetTrack(mine_);
  is_known_ = track.ok();
  if (!is_known_) return absl::OkStatus();
  if (track->pose_count > 0) next_pose_ns_ = track->last_ns + 1;
  return into_.ReadShapes(mine_, kTimeMin, kTimeMax, /*with_vertices=*/false, stop,
                          [&](const ShownShape& shown) {
                            next_shape_ns_ = shown.shape.time_ns + 1;
                            return true;
                          });
}

absl::StatusOr<std::optional<GraphDelta>> AgentCopy::Next(const StopCheck& stop) {
  while (stage_ != Stage::kEnd) {
    GraphDelta delta;
    switch (stage_) {
      case Stage::kBegin:
        DSG_RETURN_IF_ERROR(Begin(stop));
        stage_ = Stage::kPoses;
        break;
      case Stage::kPoses:
        DSG_RETURN_IF_ERROR(ReadPoses(stop, &delta));
        if (delta.empty()) stage_ = Stage::kStays;
        break;
      case Stage::kStays:
        DSG_RETURN_IF_ERROR(ReadStays(&delta));
        DSG_RETURN_IF_ERROR(ReadFactors(&delta));
        stage_ = Stage::kShapes;
        break;
      case Stage::kShapes:
        DSG_RETURN_IF_ERROR(ReadShapes(stop, &delta));
        if (delta.empty()) stage_ = Stage::kEnd;
        break;
      case Stage::kEnd:
        break;
    }
    if (!delta.empty()) return std::optional<GraphDelta>(std::move(delta));
  }
  return std::optional<GraphDelta>();
}

absl::Status AgentCopy::ReadPoses(const StopCheck& stop, GraphDelta* delta) {
  TrajectoryAppend append{mine_, {}};
  DSG_RETURN_IF_ERROR(
      other_.ReadPoses(theirs_, next_pose_ns_, kTimeMax, stop, [&](const TimedPose& pose) {
        append.poses.push_back(pose);
        TransformPose(plan_.map_T_other, &append.poses.back());
        return append.poses.size() < plan_.batch_row_count;
      }));
  if (append.poses.empty()) return absl::OkStatus();
  next_pose_ns_ = append.poses.back().time_ns + 1;
  delta->appends.push_back(std::move(append));
  return absl::OkStatus();
}

absl::Status AgentCopy::ReadStays(GraphDelta* delta) {
  DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                       other_.StaysOfAgent(theirs_, kTimeMin, kTimeMax));
  std::vector<Stay> known;
  if (is_known_) {
    DSG_ASSIGN_OR_RETURN(known, into_.StaysOfAgent(mine_, kTimeMin, kTimeMax));
  }
  for (Stay stay : stays) {
    stay.agent = mine_;
    stay.place = Mapped(stay.place);
    stay.room = Mapped(stay.room);
    const bool is_nowhere = stay.place.empty() && stay.room.empty();
    if (is_nowhere || std::find(known.begin(), known.end(), stay) != known.end()) continue;
    delta->stays.push_back(stay);
  }
  return absl::OkStatus();
}

absl::Status AgentCopy::ReadFactors(GraphDelta* delta) const {
  DSG_ASSIGN_OR_RETURN(const std::vector<PoseFactor> factors,
                       other_.Factors(theirs_, kTimeMin, kTimeMax));
  std::set<FactorKey> known;
  if (is_known_) {
    DSG_ASSIGN_OR_RETURN(const std::vector<PoseFactor> mine,
                         into_.Factors(mine_, kTimeMin, kTimeMax));
    for (const PoseFactor& factor : mine) known.insert(KeyOf(factor));
  }
  FactorAppend append{mine_, {}};
  for (PoseFactor factor : factors) {
    TransformFactor(plan_.map_T_other, &factor);
    if (!factor.to_agent.empty()) factor.to_agent = Mapped(factor.to_agent);
    if (!known.contains(KeyOf(factor))) append.factors.push_back(std::move(factor));
  }
  if (!append.factors.empty()) delta->factors.push_back(std::move(append));
  return absl::OkStatus();
}

absl::Status AgentCopy::ReadShapes(const StopCheck& stop, GraphDelta* delta) {
  ShapeAppend append{mine_, std::nullopt, {}};
  DSG_RETURN_IF_ERROR(other_.ReadShapes(theirs_, next_shape_ns_, kTimeMax, /*with_vertices=*/true,
                                        stop, [&](const ShownShape& shown) {
                                          if (append.shapes.empty())
                                            append.topology = shown.topology;
                                          if (append.topology != shown.topology) return false;
                                          append.shapes.push_back(shown.shape);
                                          return append.shapes.size() < kShapesADelta;
                                        }));
  if (append.shapes.empty()) return absl::OkStatus();
  next_shape_ns_ = append.shapes.back().time_ns + 1;
  if (append.topology.has_value()) topologies_.push_back(*append.topology);
  delta->shapes.push_back(std::move(append));
  return absl::OkStatus();
}

}  // namespace dsg::merge
