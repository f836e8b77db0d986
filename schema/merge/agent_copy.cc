// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/agent_copy.h"

#include <algorithm>
#include <set>
#include <span>
#include <tuple>

#include "schema/base/status.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

// Shapes may have thousands of vertices.
constexpr size_t kShapesADelta = 64;

using FactorKey = std::tuple<std::string, TimeNs, TimeNs, NodeId>;

FactorKey KeyOf(const PoseFactor& factor) {
  return {factor.type, factor.from_ns, factor.to_ns, factor.to_agent};
}

// Tolerances for poses that went through the codec, and for a transform estimated from such nodes.
constexpr double kSamePoseM = 1e-3;
constexpr double kSamePoseRad = 1e-3;

bool IsSame(const TimedPose& a, const TimedPose& b) {
  if (a.time_ns != b.time_ns || a.flags != b.flags) return false;
  if ((a.map_T_agent.position - b.map_T_agent.position).norm() > kSamePoseM) return false;
  return (a.flags & pose_flags::kNoOrientation) != 0 ||
         AngleBetween(a.map_T_agent.orientation, b.map_T_agent.orientation) <= kSamePoseRad;
}

using Poses = std::vector<TimedPose>;

const TimedPose* Find(const Poses& poses, TimeNs time_ns) {
  const auto found =
      std::lower_bound(poses.begin(), poses.end(), time_ns,
                       [](const TimedPose& pose, TimeNs at_ns) { return pose.time_ns < at_ns; });
  return found == poses.end() || found->time_ns != time_ns ? nullptr : &*found;
}

// A three-way merge of poses: `wanted` is the other map now, `known` this map, `bases` the other
// map when it was copied. A pose that is unchanged since the copy follows the other map; one that
// others have written or removed here stays so. Poses that only `known` has stay, because the other
// map may have forgotten them. `has_own`: others extend the track here.
Poses Reconcile(const Poses& wanted, const Poses& known, const std::vector<Poses>& bases,
                bool has_own) {
  const auto was_in_all = [&](TimeNs time_ns) {
    return std::all_of(bases.begin(), bases.end(),
                       [&](const Poses& base) { return Find(base, time_ns) != nullptr; });
  };
  const auto is_of_a_base = [&](const TimedPose& pose) {
    return std::any_of(bases.begin(), bases.end(), [&](const Poses& base) {
      const TimedPose* before = Find(base, pose.time_ns);
      return before != nullptr && IsSame(*before, pose);
    });
  };
  has_own = has_own || std::any_of(known.begin(), known.end(), [&](const TimedPose& pose) {
              return Find(wanted, pose.time_ns) == nullptr && !is_of_a_base(pose);
            });
  Poses believed;
  auto at = known.begin();
  for (const TimedPose& pose : wanted) {
    while (at != known.end() && at->time_ns < pose.time_ns) believed.push_back(*at++);
    if (at == known.end() || at->time_ns != pose.time_ns) {
      if (!has_own && !was_in_all(pose.time_ns)) believed.push_back(pose);
      continue;
    }
    const bool follows = !IsSame(pose, *at) && is_of_a_base(*at);
    believed.push_back(follows ? pose : *at);
    ++at;
  }
  believed.insert(believed.end(), at, known.end());
  return believed;
}

// From the first to the last pose of `wanted` that `known` lacks; empty if it has all.
std::span<const TimedPose> PartThatDiffers(const Poses& wanted, const Poses& known) {
  size_t first = wanted.size();
  size_t last = 0;
  for (size_t i = 0; i < wanted.size(); ++i) {
    const TimedPose* same = Find(known, wanted[i].time_ns);
    if (same != nullptr && IsSame(wanted[i], *same)) continue;
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
  const auto bases = plan_.track_bases.find(mine_);
  if (bases != plan_.track_bases.end() && !bases->second.empty()) bases_ = &bases->second;
  if (bases_ != nullptr) DSG_RETURN_IF_ERROR(LookAtEnd(*track, stop));
  return into_.ReadShapes(mine_, kTimeMin, kTimeMax, /*with_vertices=*/false, stop,
                          [&](const ShownShape& shown) {
                            next_shape_ns_ = shown.shape.time_ns + 1;
                            return true;
                          });
}

absl::Status AgentCopy::LookAtEnd(const TrackInfo& track, const StopCheck& stop) {
  if (track.pose_count == 0) return absl::OkStatus();
  const TimeNs last_ns = track.last_ns;
  DSG_ASSIGN_OR_RETURN(const Poses now, Carried(last_ns, last_ns + 1, stop));
  DSG_ASSIGN_OR_RETURN(const std::vector<Poses> bases, CarriedBefore(last_ns, last_ns + 1, stop));
  has_own_end_ = now.empty() && std::all_of(bases.begin(), bases.end(),
                                            [](const Poses& base) { return base.empty(); });
  return absl::OkStatus();
}

absl::StatusOr<std::optional<GraphDelta>> AgentCopy::Next(const StopCheck& stop) {
  while (stage_ != Stage::kEnd) {
    GraphDelta delta;
    switch (stage_) {
      case Stage::kBegin:
        DSG_RETURN_IF_ERROR(Begin(stop));
        stage_ = bases_ != nullptr ? Stage::kCorrections : Stage::kPoses;
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

absl::StatusOr<std::vector<std::vector<TimedPose>>> AgentCopy::CarriedBefore(
    TimeNs from_ns, TimeNs to_ns, const StopCheck& stop) const {
  std::vector<Poses> all;
  for (const std::shared_ptr<const Snapshot>& base : *bases_) {
    Poses& poses = all.emplace_back();
    const absl::Status read =
        (base != nullptr ? *base : other_)
            .ReadPoses(theirs_, from_ns, to_ns, stop, [&](const TimedPose& pose) {
              poses.push_back(pose);
              TransformPose(plan_.map_T_other_before, &poses.back());
              return true;
            });
    // Not every base has the agent.
    if (ReasonOf(read) != Reason::kAgentUnknown) DSG_RETURN_IF_ERROR(read);
  }
  return all;
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
    DSG_ASSIGN_OR_RETURN(const std::vector<Poses> bases,
                         CarriedBefore(wanted.front().time_ns, compared_to_ns_, stop));
    const Poses believed = Reconcile(wanted, known, bases, has_own_end_);
    const std::span<const TimedPose> part = PartThatDiffers(believed, known);
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

absl::StatusOr<bool> AgentCopy::IsAsWritten(const Stay& known) const {
  if (bases_ == nullptr) return !plan_.copied_agents.contains(mine_);
  for (const std::shared_ptr<const Snapshot>& base : *bases_) {
    auto stays = (base != nullptr ? *base : other_)
                     .StaysOfAgent(theirs_, known.enter_ns, known.enter_ns + 1);
    if (ReasonOf(stays.status()) == Reason::kAgentUnknown) continue;
    DSG_RETURN_IF_ERROR(stays.status());
    for (Stay& stay : *stays) {
      stay.agent = mine_;
      stay.place = Mapped(stay.place);
      stay.room = Mapped(stay.room);
      if (stay == known) return true;
    }
  }
  return false;
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
    const auto mine = std::find_if(known.begin(), known.end(), [&](const Stay& each) {
      return each.enter_ns == stay.enter_ns;
    });
    if (mine != known.end()) {
      DSG_ASSIGN_OR_RETURN(const bool follows, IsAsWritten(*mine));
      if (!follows) continue;
    }
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
    if (!factor.to_agent.empty()) {
      factor.to_agent = Mapped(factor.to_agent);
      if (factor.to_agent.empty()) continue;
    }
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
