// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/agent_copy.h"

#include <algorithm>
#include <set>
#include <span>
#include <tuple>

#include "schema/base/status.h"
#include "schema/merge/origins.h"
#include "schema/merge/transform_node.h"

namespace dsg::merge {
namespace {

// Shapes may have thousands of vertices.
constexpr size_t kShapesADelta = 64;

using FactorKey = std::tuple<std::string, TimeNs, TimeNs, NodeId>;

FactorKey KeyOf(const PoseFactor& factor) {
  return {factor.type, factor.from_ns, factor.to_ns, factor.to_agent};
}

// Through a codec, and through a transform told from nodes that went through it.
constexpr double kSameM = 1e-3;
constexpr double kSameRad = 1e-3;

bool IsSame(const TimedPose& a, const TimedPose& b) {
  if (a.time_ns != b.time_ns || a.flags != b.flags) return false;
  if ((a.map_T_agent.position - b.map_T_agent.position).norm() > kSameM) return false;
  return (a.flags & pose_flags::kNoOrientation) != 0 ||
         AngleBetween(a.map_T_agent.orientation, b.map_T_agent.orientation) <= kSameRad;
}

// From the first to the last of `wanted` that `known` has not: an empty span if it has all. Both
// ascend in time. What only `known` has is nobody's correction: the other map may have forgotten
// it.
std::span<const TimedPose> PartThatDiffers(const std::vector<TimedPose>& wanted,
                                           const std::vector<TimedPose>& known) {
  size_t first = wanted.size();
  size_t last = 0;
  auto at = known.begin();
  for (size_t i = 0; i < wanted.size(); ++i) {
    while (at != known.end() && at->time_ns < wanted[i].time_ns) ++at;
    if (at != known.end() && IsSame(wanted[i], *at)) continue;
    first = std::min(first, i);
    last = i;
  }
  if (first == wanted.size()) return {};
  return std::span(wanted).subspan(first, last - first + 1);
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
  DSG_ASSIGN_OR_RETURN(const Node node, into_.GetNode(mine_));
  const auto copy = CopiedFrom(node);
  is_copy_ = copy.has_value() && copy->map == plan_.other_name && copy->id == theirs_;
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
        stage_ = is_copy_ ? Stage::kCorrections : Stage::kPoses;
        break;
      case Stage::kCorrections:
        DSG_RETURN_IF_ERROR(ReadCorrections(stop, &delta));
        if (delta.empty()) stage_ = Stage::kPoses;
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

absl::StatusOr<std::vector<TimedPose>> AgentCopy::Carried(TimeNs from_ns, TimeNs to_ns,
                                                          const StopCheck& stop) const {
  std::vector<TimedPose> poses;
  DSG_RETURN_IF_ERROR(other_.ReadPoses(theirs_, from_ns, to_ns, stop, [&](const TimedPose& pose) {
    poses.push_back(pose);
    TransformPose(plan_.map_T_other, &poses.back());
    return poses.size() < plan_.batch_row_count;
  }));
  return poses;
}

absl::Status AgentCopy::ReadCorrections(const StopCheck& stop, GraphDelta* delta) {
  while (delta->empty()) {
    DSG_ASSIGN_OR_RETURN(const std::vector<TimedPose> wanted,
                         Carried(compared_to_ns_, next_pose_ns_, stop));
    if (wanted.empty()) return absl::OkStatus();
    compared_to_ns_ = wanted.back().time_ns + 1;
    std::vector<TimedPose> known;
    DSG_RETURN_IF_ERROR(into_.ReadPoses(mine_, wanted.front().time_ns, compared_to_ns_, stop,
                                        [&](const TimedPose& pose) {
                                          known.push_back(pose);
                                          return true;
                                        }));
    const std::span<const TimedPose> part = PartThatDiffers(wanted, known);
    if (part.empty()) continue;
    delta->corrections.push_back(
        {mine_, part.front().time_ns, part.back().time_ns + 1, {part.begin(), part.end()}});
  }
  return absl::OkStatus();
}

absl::Status AgentCopy::ReadPoses(const StopCheck& stop, GraphDelta* delta) {
  DSG_ASSIGN_OR_RETURN(std::vector<TimedPose> poses, Carried(next_pose_ns_, kTimeMax, stop));
  if (poses.empty()) return absl::OkStatus();
  next_pose_ns_ = poses.back().time_ns + 1;
  delta->appends.push_back({mine_, std::move(poses)});
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
