// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/compare_tracks.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/evaluation/pose_file.h"
#include "ingest/evaluation/report.h"
#include "schema/base/status.h"

namespace dsg::evaluation {
namespace {

struct NamedTrack {
  std::string name;
  std::vector<StampedPose> poses;
};

/// What is to be compared with the truth.
struct Estimates {
  std::string words;
  std::vector<NamedTrack> tracks;
  bool has_times = true;
  std::optional<std::vector<FoundLoop>> loops;
};

void Append(const std::vector<std::string>& notes, TrackReport* report) {
  report->notes.insert(report->notes.end(), notes.begin(), notes.end());
}

absl::StatusOr<Estimates> EstimateOfFile(const std::string& path, TrackReport* report) {
  DSG_ASSIGN_OR_RETURN(PoseFile file, ReadPoseFile(path, /*epoch_ns=*/0));
  Append(file.notes, report);
  Estimates out;
  out.words = absl::StrCat("trajectory ", file.path);
  out.has_times = file.has_times;
  out.tracks.push_back({"file", std::move(file.poses)});
  return out;
}

absl::StatusOr<Estimates> EstimatesOfMap(const TrackRequest& request, MapReader& map,
                                         const ProgressFunction& progress, TrackReport* report) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> snapshot,
                       request.revision == 0 ? map.Latest() : map.At(request.revision));
  DSG_ASSIGN_OR_RETURN(std::optional<RobotTracks> robot,
                       ReadRobotTracks(map, *snapshot, request.robot, progress));
  if (!robot.has_value()) {
    return MakeError(
        Reason::kAgentUnknown,
        absl::StrCat("map ", snapshot->spec().name, " at revision ", snapshot->revision(),
                     " has no robot with poses, so no trajectory to score"));
  }
  Append(robot->notes, report);
  Estimates out;
  out.words = absl::StrCat("map ", snapshot->spec().name, " at revision ", snapshot->revision(),
                           ", robot ", ToString(robot->agent), " (", robot->name, ")");
  out.tracks.push_back({"causal", std::move(robot->causal)});
  out.tracks.push_back({"corrected", std::move(robot->corrected)});
  if (!robot->loops.empty()) out.loops = std::move(robot->loops);
  return out;
}

absl::StatusOr<Pairing> ChoosePairing(const TrackRequest& request, const Estimates& estimates,
                                      const PoseFile& truth) {
  const bool has_times = estimates.has_times && truth.has_times;
  const Pairing pairing =
      request.pairing.value_or(has_times ? Pairing::kInterpolate : Pairing::kRows);
  if (has_times || pairing == Pairing::kRows) return pairing;
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(truth.has_times ? estimates.words : truth.path,
                                " has no times, so its poses cannot be associated by them; leave "
                                "--associate out, or say --associate rows"),
                   {{"field", "associate"}, {"value", NameOf(pairing)}});
}

absl::Status CheckRowCounts(const NamedTrack& track, const PoseFile& truth) {
  if (track.poses.size() == truth.poses.size()) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("the ", track.name, " trajectory has ", track.poses.size(), " poses and ",
                   truth.path, " has ", truth.poses.size(),
                   "; row by row as many are due of each: give files of the same frames, or a "
                   "truth with times"),
      {{"field", "truth"}, {"value", truth.path}});
}

// A pose is causal: what comes after the end has not changed it. Corrected poses know the whole
// log.
absl::Status CutAt(TimeNs until_ns, PoseFile* truth, Estimates* estimates) {
  if (!truth->has_times || !estimates->has_times) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(truth->has_times ? estimates->words : truth->path,
                                  " has no times, so there is no first part of so many seconds; "
                                  "leave --until out"),
                     {{"field", "until"}});
  }
  if (truth->poses.empty()) return absl::OkStatus();
  const TimeNs end_ns = truth->poses.front().time_ns + until_ns;
  const auto is_after = [end_ns](const StampedPose& pose) { return pose.time_ns > end_ns; };
  std::erase_if(truth->poses, is_after);
  for (NamedTrack& track : estimates->tracks) std::erase_if(track.poses, is_after);
  if (estimates->loops.has_value()) {
    std::erase_if(*estimates->loops, [end_ns](const FoundLoop& loop) {
      return std::max(loop.from_ns, loop.to_ns) > end_ns;
    });
  }
  return absl::OkStatus();
}

void NoteCoverage(const TrackScore& score, TrackReport* report) {
  if (score.pair_count == 0) {
    report->notes.push_back(absl::StrCat("no pose of the ", score.name,
                                         " trajectory falls into the time of the truth: it is that "
                                         "of another log, or of another clock"));
    return;
  }
  if (score.coverage.has_value() && *score.coverage < kCoverageMin) {
    report->notes.push_back(
        absl::StrCat("the ", score.name,
                     " trajectory covers less than 95 % of the time of the truth; of a whole log "
                     "that counts as failure"));
  }
}

void ScoreLoops(const Estimates& estimates, const PoseFile& truth, TrackReport* report) {
  // Those of the poses that are believed at last.
  const std::vector<StampedPose>& poses = estimates.tracks.back().poses;
  if (!estimates.loops.has_value() || poses.empty()) return;
  if (!estimates.has_times || !truth.has_times) {
    report->notes.push_back("loop closures are not scored: the poses have no times");
    return;
  }
  report->loops =
      EvaluateLoops(*estimates.loops, truth.poses, poses.front().time_ns, poses.back().time_ns,
                    report->options.tolerance_ns, report->options.loops);
}

}  // namespace

absl::StatusOr<TrackReport> CompareTracks(const TrackRequest& request, MapReader* map,
                                          const ProgressFunction& progress) {
  TrackReport report;
  report.options = request.options;
  if (progress) progress("reading the truth", 0.0);
  const TimeNs epoch_ns = map == nullptr ? 0 : map->spec().epoch_ns;
  DSG_ASSIGN_OR_RETURN(PoseFile truth, ReadPoseFile(request.truth, epoch_ns));
  report.truth = truth.path;
  Append(truth.notes, &report);
  DSG_ASSIGN_OR_RETURN(Estimates estimates, map == nullptr
                                                ? EstimateOfFile(request.estimate, &report)
                                                : EstimatesOfMap(request, *map, progress, &report));
  report.estimate = estimates.words;
  if (!request.loops.empty()) {
    DSG_ASSIGN_OR_RETURN(estimates.loops, ReadLoopFile(request.loops, &report.notes));
  }
  if (request.options.until_ns.has_value()) {
    DSG_RETURN_IF_ERROR(CutAt(*request.options.until_ns, &truth, &estimates));
  }
  DSG_ASSIGN_OR_RETURN(report.options.pairing, ChoosePairing(request, estimates, truth));
  for (const NamedTrack& track : estimates.tracks) {
    if (report.options.pairing == Pairing::kRows) {
      DSG_RETURN_IF_ERROR(CheckRowCounts(track, truth));
    }
    report.tracks.push_back(ScoreTrack(track.name, track.poses, truth.poses, report.options));
    NoteCoverage(report.tracks.back(), &report);
  }
  ScoreLoops(estimates, truth, &report);
  return report;
}

}  // namespace dsg::evaluation
