// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/reconciler.h"

#include <algorithm>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/place_memory.h"

namespace dsg::ingest {
namespace {

// The quantised codec keeps each coordinate within 0.1 mm and rotations within 6e-5 rad; a log
// that differs by more says something else.
constexpr double kCoordinateBoundM = 1.001e-4;
constexpr double kAngleBoundRad = 6.1e-5;

bool SaysTheSame(const TimedPose& stored, const TimedPose& log, TrajectoryCodec codec) {
  // A loop closure moved the stored pose; the log's raw one is the older belief, no contradiction.
  if ((stored.flags & pose_flags::kCorrected) != 0) return true;
  const Eigen::Vector3d offset = stored.map_T_agent.position - log.map_T_agent.position;
  const bool has_orientation = ((stored.flags | log.flags) & pose_flags::kNoOrientation) == 0;
  if (codec == TrajectoryCodec::kLossless) {
    return offset == Eigen::Vector3d::Zero() &&
           (!has_orientation ||
            stored.map_T_agent.orientation.coeffs() == log.map_T_agent.orientation.coeffs());
  }
  return offset.cwiseAbs().maxCoeff() <= kCoordinateBoundM &&
         (!has_orientation || AngleBetween(stored.map_T_agent.orientation,
                                           log.map_T_agent.orientation) <= kAngleBoundRad);
}

std::string FormatPosition(const Eigen::Vector3d& p) {
  return absl::StrFormat("(%.4f, %.4f, %.4f) m", p.x(), p.y(), p.z());
}

absl::Status Conflict(const TrackInfo& track, const TimedPose& log, const TimedPose* stored) {
  const std::string stored_text =
      stored == nullptr
          ? absl::StrCat("the map has no pose then, and its track goes on to ", track.last_ns,
                         " ns")
          : absl::StrCat("the map has it at ", FormatPosition(stored->map_T_agent.position),
                         log.map_T_agent.position.isApprox(stored->map_T_agent.position, 1e-6)
                             ? " with another orientation"
                             : "");
  return MakeError(
      Reason::kTrackConflict,
      absl::StrCat("agent ", ToString(track.agent), " \"", track.name, "\" at ", log.time_ns,
                   " ns: the log has it at ", FormatPosition(log.map_T_agent.position), ", ",
                   stored_text,
                   "; if it is another agent of that name, give --agent-prefix; if another "
                   "recording, another --map"),
      {{"agent", ToString(track.agent)}, {"time_ns", absl::StrCat(log.time_ns)}});
}

bool IsSameNode(const Node& a, const Node& b) {
  return a.layer == b.layer && EncodeNodePayload(a) == EncodeNodePayload(b);
}

bool IsSameEdge(const Edge& a, const Edge& b) {
  return a.weight == b.weight && EncodeEdgePayload(a) == EncodeEdgePayload(b);
}

}  // namespace

void Reconciler::ObserveCommitted(const GraphDelta& delta) {
  for (const Stay& stay : delta.stays) {
    Stay& newest = told_.try_emplace(stay.agent, stay).first->second;
    if (stay.enter_ns >= newest.enter_ns) newest = stay;
  }
}

void Reconciler::ForgetNode(NodeId agent) {
  const auto known = known_.find(agent);
  if (known != known_.end()) known->second.node.reset();
}

absl::Status Reconciler::CountNews(const std::vector<GraphDelta>& parts) {
  for (const GraphDelta& part : parts) {
    for (const TrajectoryAppend& append : part.appends) {
      DSG_ASSIGN_OR_RETURN(Known* const known, Find(append.agent));
      for (const TimedPose& pose : append.poses) {
        const bool is_new = !known->track.has_value() || pose.time_ns > known->track->last_ns;
        known->new_pose_count += is_new ? 1 : 0;
      }
    }
  }
  return absl::OkStatus();
}

absl::Status Reconciler::Reconcile(GraphDelta* delta) {
  DSG_RETURN_IF_ERROR(ReconcileAppends(delta));
  DSG_RETURN_IF_ERROR(ReconcileNodes(delta));
  DSG_RETURN_IF_ERROR(ReconcileEdges(delta));
  return ReconcileStays(delta);
}

absl::StatusOr<Reconciler::Known*> Reconciler::Find(NodeId agent) {
  const auto [entry, is_new] = known_.try_emplace(agent);
  Known* known = &entry->second;
  if (!is_new) return known;
  DSG_ASSIGN_OR_RETURN(known->node, map_.FindNode(agent));
  DSG_ASSIGN_OR_RETURN(known->track, map_.FindTrack(agent));
  if (known->track.has_value()) {
    const TimeNs end_ns = known->track->last_ns;
    DSG_ASSIGN_OR_RETURN(known->last_stay, map_.StayAt(agent, end_ns));
    const auto told = told_.find(agent);
    if (told != told_.end() && told->second.enter_ns <= end_ns && end_ns < told->second.exit_ns) {
      known->is_last_open = told->second.exit_ns == kTimeMax;
      known->is_last_settled = true;
      if (!known->last_stay.has_value()) known->last_stay = told->second;
    }
  }
  return known;
}

absl::Status Reconciler::ReconcileNodes(GraphDelta* delta) {
  std::vector<Node> news;
  for (Node& node : delta->nodes) {
    bool is_news = true;
    if (IsAgentKind(node.kind)) {
      DSG_ASSIGN_OR_RETURN(is_news, MergeAgent(&node));
    } else {
      DSG_ASSIGN_OR_RETURN(const std::optional<Node> stored, map_.FindNode(node.id));
      is_news = !stored.has_value() || !IsSameNode(*stored, node);
    }
    if (is_news) news.push_back(std::move(node));
  }
  delta->nodes = std::move(news);
  return absl::OkStatus();
}

// The union of what map and log know of an agent; the same whether or not the map holds a part
// of this log already. False when the map knows all of it.
absl::StatusOr<bool> Reconciler::MergeAgent(Node* node) {
  DSG_ASSIGN_OR_RETURN(Known* const known, Find(node->id));
  if (!known->node.has_value()) return true;
  Node merged = *known->node;
  merged.revision = 0;
  const Node& log = *node;
  const bool is_newer = !merged.last_observed_ns.has_value() ||
                        log.last_observed_ns.value_or(kTimeMin) > *merged.last_observed_ns;
  if (is_newer) {
    merged.map_T_node = log.map_T_node;
    merged.last_observed_ns = log.last_observed_ns;
    // Seen again after it was thought to have left.
    if (merged.valid.to_ns <= log.last_observed_ns.value_or(kTimeMin)) {
      merged.valid.to_ns = kTimeMax;
    }
  }
  merged.valid.from_ns = std::min(merged.valid.from_ns, log.valid.from_ns);
  if (log.first_observed_ns.has_value()) {
    merged.first_observed_ns =
        std::min(merged.first_observed_ns.value_or(kTimeMax), *log.first_observed_ns);
  }
  const int64_t stored_count = known->track.has_value() ? known->track->pose_count : 0;
  merged.observation_count =
      std::max(merged.observation_count, stored_count + known->new_pose_count);
  AddPlaceMemory(log, &merged);
  if (IsSameNode(merged, *known->node)) return false;
  *node = merged;
  return true;
}

absl::Status Reconciler::ReconcileEdges(GraphDelta* delta) {
  std::vector<Edge> news;
  for (Edge& edge : delta->edges) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Edge> stored, map_.FindEdge(edge.key()));
    if (!stored.has_value() || !IsSameEdge(*stored, edge)) news.push_back(std::move(edge));
  }
  delta->edges = std::move(news);
  return absl::OkStatus();
}

absl::Status Reconciler::ReconcileAppends(GraphDelta* delta) {
  std::vector<TrajectoryAppend> news;
  for (TrajectoryAppend& append : delta->appends) {
    DSG_ASSIGN_OR_RETURN(Known* const known, Find(append.agent));
    if (known->track.has_value()) {
      const auto first_new = std::find_if(
          append.poses.begin(), append.poses.end(),
          [known](const TimedPose& pose) { return pose.time_ns > known->track->last_ns; });
      const std::vector<TimedPose> overlap(append.poses.begin(), first_new);
      DSG_RETURN_IF_ERROR(CompareStored(*known->track, overlap));
      skipped_pose_count_ += static_cast<int64_t>(overlap.size());
      append.poses.erase(append.poses.begin(), first_new);
    }
    if (!append.poses.empty()) news.push_back(std::move(append));
  }
  delta->appends = std::move(news);
  return absl::OkStatus();
}

absl::Status Reconciler::CompareStored(const TrackInfo& track,
                                       const std::vector<TimedPose>& log) const {
  if (log.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::vector<TimedPose> stored,
                       map_.ReadPoses(track.agent, log.front().time_ns, log.back().time_ns + 1));
  size_t next = 0;
  // Asked for only where a pose is missing.
  std::optional<TimeNs> kept_from_ns;
  for (const TimedPose& pose : log) {
    while (next < stored.size() && stored[next].time_ns < pose.time_ns) ++next;
    const bool is_there = next < stored.size() && stored[next].time_ns == pose.time_ns;
    if (!is_there) {
      if (!kept_from_ns.has_value()) {
        DSG_ASSIGN_OR_RETURN(kept_from_ns, KeptFrom(track.agent));
      }
      // Forgotten while the log is read.
      if (track.first_ns <= pose.time_ns && pose.time_ns < *kept_from_ns) continue;
      return Conflict(track, pose, nullptr);
    }
    if (!SaysTheSame(stored[next], pose, map_.spec().codec)) {
      return Conflict(track, pose, &stored[next]);
    }
  }
  return absl::OkStatus();
}

// Where a track begins by now that began earlier when the log did.
absl::StatusOr<TimeNs> Reconciler::KeptFrom(NodeId agent) const {
  DSG_ASSIGN_OR_RETURN(const std::optional<TrackInfo> now, map_.FindTrackNow(agent));
  return now.has_value() ? now->first_ns : kTimeMax;
}

absl::Status Reconciler::ReconcileStays(GraphDelta* delta) {
  std::vector<Stay> news;
  for (const Stay& stay : delta->stays) {
    DSG_ASSIGN_OR_RETURN(Known* const known, Find(stay.agent));
    DSG_ASSIGN_OR_RETURN(const bool is_moved, IsInAnotherRoom(stay, *known));
    if (is_moved) news.push_back(stay);
    ReconcileStay(stay, known, &news);
  }
  for (const TrajectoryAppend& append : delta->appends) {
    DSG_ASSIGN_OR_RETURN(Known* const known, Find(append.agent));
    SettleLastStay(known, &news);
  }
  std::sort(news.begin(), news.end(), [](const Stay& a, const Stay& b) {
    return std::tie(a.agent, a.enter_ns) < std::tie(b.agent, b.enter_ns);
  });
  delta->stays = std::move(news);
  return absl::OkStatus();
}

// The log knows the same stay at the same place, but the place has come to another room since.
absl::StatusOr<bool> Reconciler::IsInAnotherRoom(const Stay& stay, const Known& known) const {
  if (!known.track.has_value() || stay.place.empty() || stay.exit_ns > known.track->last_ns) {
    return false;
  }
  DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stored, map_.StayAt(stay.agent, stay.enter_ns));
  return stored.has_value() && stored->enter_ns == stay.enter_ns &&
         stored->exit_ns == stay.exit_ns && stored->place == stay.place &&
         stored->room != stay.room;
}

void Reconciler::ReconcileStay(const Stay& stay, Known* known, std::vector<Stay>* news) {
  if (!known->track.has_value() || stay.enter_ns > known->track->last_ns) {
    news->push_back(stay);
    return;
  }
  const TimeNs after_end_ns = known->track->last_ns + 1;
  const std::optional<Stay>& last = known->last_stay;
  const bool is_continued = last.has_value() && stay.enter_ns <= last->enter_ns &&
                            last->enter_ns < stay.exit_ns && last->place == stay.place &&
                            last->room == stay.room;
  // The stored stay is the same one, perhaps begun later where an overlap was cut; what is
  // stored otherwise up to the end stays as it is.
  Stay rest = stay;
  rest.enter_ns = is_continued ? last->enter_ns : after_end_ns;
  known->held.reset();
  if (stay.exit_ns == kTimeMax) {
    if (!is_continued || !known->is_last_open) known->held = rest;
  } else if (stay.exit_ns > after_end_ns || (is_continued && known->is_last_open)) {
    news->push_back(rest);
    if (is_continued) known->is_last_settled = true;
    known->is_last_open = false;
  }
}

// Called where the agent has new poses.
void Reconciler::SettleLastStay(Known* known, std::vector<Stay>* news) {
  const std::optional<Stay>& last = known->last_stay;
  const bool is_held_continuing =
      known->held.has_value() && last.has_value() && known->held->enter_ns == last->enter_ns;
  if (last.has_value() && !known->is_last_settled && !is_held_continuing) {
    // Perhaps left open by a run that never went on; its agent was seen elsewhere since.
    Stay ended = *last;
    ended.exit_ns = known->track->last_ns + 1;
    news->push_back(ended);
  }
  known->is_last_settled = true;
  if (known->held.has_value()) news->push_back(*known->held);
  known->held.reset();
}

}  // namespace dsg::ingest
