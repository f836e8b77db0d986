// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/robot_tracks.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"

namespace dsg::evaluation {
namespace {

constexpr int kRevisionPage = 1000;
constexpr char kLoopClosure[] = "loop_closure";
constexpr char kLoopRejected[] = "loop_closure_rejected";

StopCheck GoOn() {
  return [] { return absl::OkStatus(); };
}

bool IsMovedRobot(const TrackInfo& track) {
  return track.kind == kinds::kRobot && track.pose_count > 0;
}

absl::StatusOr<std::optional<TrackInfo>> ChooseRobot(const Snapshot& snapshot,
                                                     const std::string& robot,
                                                     std::vector<std::string>* notes) {
  DSG_ASSIGN_OR_RETURN(std::vector<TrackInfo> tracks, snapshot.Tracks());
  std::erase_if(tracks, [](const TrackInfo& track) { return !IsMovedRobot(track); });
  if (robot.empty()) {
    if (tracks.empty()) return std::nullopt;
    if (tracks.size() > 1) {
      notes->push_back(absl::StrCat("the map has ", tracks.size(), " robots; only ",
                                    ToString(tracks[0].agent), " (", tracks[0].name,
                                    ") is scored"));
    }
    return tracks[0];
  }
  std::vector<std::string> known;
  for (const TrackInfo& track : tracks) {
    if (track.name == robot || ToString(track.agent) == robot) return track;
    known.push_back(absl::StrCat(ToString(track.agent), " (", track.name, ")"));
  }
  return MakeError(
      Reason::kAgentUnknown,
      absl::StrCat("map ", snapshot.spec().name, " has no robot \"", robot,
                   "\" with poses; it has ", known.empty() ? "none" : absl::StrJoin(known, ", ")),
      {{"agent", robot}});
}

/// Reads what one robot was told to be, revision after revision.
class CausalReader {
 public:
  CausalReader(MapReader& map, const Snapshot& snapshot, const ProgressFunction& progress,
               RobotTracks* out)
      : map_(map), snapshot_(snapshot), progress_(progress), out_(*out) {}

  absl::Status Read() {
    DSG_ASSIGN_OR_RETURN(const std::vector<Revision> revisions, GrowingRevisions());
    for (size_t i = 0; i < revisions.size(); ++i) {
      if (progress_) {
        progress_("causal trajectory",
                  static_cast<double>(i) / static_cast<double>(revisions.size()));
      }
      DSG_RETURN_IF_ERROR(ReadRevision(revisions[i]));
    }
    if (chunk_count_ == 1) {
      out_.notes.push_back(
          "the robot's poses came in one revision, so the store cannot tell causal poses from "
          "smoothed ones: causal figures may be of smoothed poses");
    }
    return absl::OkStatus();
  }

 private:
  absl::Status ReadRevision(Revision revision) {
    DSG_ASSIGN_OR_RETURN(const auto then, map_.At(revision));
    const auto track = then->GetTrack(out_.agent);
    // Not there yet.
    if (absl::IsNotFound(track.status())) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(track.status());
    if (track->pose_count == 0 || (known_ns_.has_value() && track->last_ns <= *known_ns_)) {
      return absl::OkStatus();
    }
    const TimeNs from_ns = known_ns_.has_value() ? *known_ns_ + 1 : kTimeMin;
    DSG_ASSIGN_OR_RETURN(std::vector<StampedPose> poses,
                         ReadStampedPoses(*then, out_.agent, from_ns, kTimeMax));
    std::move(poses.begin(), poses.end(), std::back_inserter(out_.causal));
    known_ns_ = track->last_ns;
    ++chunk_count_;
    return absl::OkStatus();
  }

  // Ascending; only those after which there were more poses than before.
  absl::StatusOr<std::vector<Revision>> GrowingRevisions() {
    DSG_ASSIGN_OR_RETURN(const Revision oldest, map_.OldestRevision());
    std::vector<std::pair<Revision, int64_t>> pose_counts;
    Revision before = snapshot_.revision() + 1;
    while (before > 1) {
      DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> page,
                           map_.ListRevisions(before, kRevisionPage));
      if (page.empty()) break;
      for (const RevisionInfo& info : page) {
        pose_counts.emplace_back(info.revision, info.pose_count);
      }
      before = page.back().revision;
      if (before <= oldest) break;
    }
    std::reverse(pose_counts.begin(), pose_counts.end());
    if (oldest > 1) {
      out_.notes.push_back(absl::StrCat("revisions before ", oldest,
                                        " are compacted: poses of that time are as smoothed then"));
    }
    std::vector<Revision> revisions;
    int64_t last_count = -1;
    for (const auto& [revision, pose_count] : pose_counts) {
      if (revision >= oldest && pose_count != last_count) revisions.push_back(revision);
      last_count = pose_count;
    }
    return revisions;
  }

  MapReader& map_;
  const Snapshot& snapshot_;
  const ProgressFunction& progress_;
  RobotTracks& out_;
  /// Up to and with this stamp, what was first said is known.
  std::optional<TimeNs> known_ns_;
  int chunk_count_ = 0;
};

absl::Status ReadLoops(const Snapshot& snapshot, RobotTracks* out) {
  DSG_ASSIGN_OR_RETURN(const std::vector<PoseFactor> factors,
                       snapshot.Factors(out->agent, kTimeMin, kTimeMax));
  int64_t foreign_count = 0;
  for (const PoseFactor& factor : factors) {
    const bool is_believed = factor.type == kLoopClosure;
    if (!is_believed && factor.type != kLoopRejected) continue;
    if (!factor.to_agent.empty() && factor.to_agent != out->agent) {
      ++foreign_count;
      continue;
    }
    out->loops.push_back({factor.from_ns, factor.to_ns, factor.relative_pose, is_believed});
  }
  if (foreign_count > 0) {
    out->notes.push_back(absl::StrCat(foreign_count,
                                      " loop closures to other robots are not "
                                      "scored"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<StampedPose>> ReadStampedPoses(const Snapshot& snapshot, NodeId agent,
                                                          TimeNs from_ns, TimeNs to_ns) {
  std::vector<StampedPose> poses;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadPoses(agent, from_ns, to_ns, GoOn(), [&poses](const TimedPose& pose) {
        if ((pose.flags & pose_flags::kPredicted) == 0) {
          poses.push_back({pose.time_ns, pose.map_T_agent, pose.covariance});
        }
        return true;
      }));
  return poses;
}

absl::StatusOr<std::optional<RobotTracks>> ReadRobotTracks(MapReader& map, const Snapshot& snapshot,
                                                           const std::string& robot,
                                                           const ProgressFunction& progress) {
  RobotTracks out;
  DSG_ASSIGN_OR_RETURN(const std::optional<TrackInfo> track,
                       ChooseRobot(snapshot, robot, &out.notes));
  if (!track.has_value()) return std::nullopt;
  out.agent = track->agent;
  out.name = track->name;
  DSG_ASSIGN_OR_RETURN(out.corrected, ReadStampedPoses(snapshot, out.agent, kTimeMin, kTimeMax));
  DSG_RETURN_IF_ERROR(CausalReader(map, snapshot, progress, &out).Read());
  DSG_RETURN_IF_ERROR(ReadLoops(snapshot, &out));
  return out;
}

}  // namespace dsg::evaluation
