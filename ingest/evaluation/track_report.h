// SPDX-License-Identifier: Apache-2.0
// All figures of trajectories against one ground truth, as tables for people and as JSON.
// Refuses zeros for what cannot be said: that is null, or a dash.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ingest/evaluation/loops.h"
#include "ingest/evaluation/trajectory.h"

namespace dsg::evaluation {

/// Which true pose goes with an estimated one.
enum class Pairing { kInterpolate, kNearest, kRows };

struct TrackOptions {
  Alignment alignment = Alignment::kSe3;
  Pairing pairing = Pairing::kInterpolate;
  /// Of AssociatePoses and RelativeErrorOverTime.
  TimeNs tolerance_ns = kTruthGapNsMax;
  /// Of Coverage.
  TimeNs reach_ns = kTruthGapNsMax;
  std::vector<double> rpe_lengths_m = {1.0, 5.0, 10.0, 20.0};
  std::vector<TimeNs> rpe_durations_ns = {kNsPerSecond};
  LoopOptions loops;
  /// What is scored ends so long after the first true pose; nullopt: with the log.
  std::optional<TimeNs> until_ns;
};

struct TrackScore {
  /// "causal", "corrected" or "file".
  std::string name;
  int64_t pose_count = 0;
  /// Of which the truth is known.
  int64_t pair_count = 0;
  /// Share of the truth's time; nullopt by rows, and without poses.
  std::optional<double> coverage;
  /// True path over the pairs.
  double path_m = 0.0;
  std::optional<AteResult> ate;
  /// Set with `ate`.
  std::optional<Similarity> truth_T_estimate;
  /// Those that the path is long enough for, as the options order them. None of `rpe_time` by rows.
  std::vector<RpeResult> rpe;
  std::vector<RpeTimeResult> rpe_time;
  std::optional<NeesResult> nees;
};

/// Requires: with kRows as many poses of each.
TrackScore ScoreTrack(const std::string& name, const std::vector<StampedPose>& estimate,
                      const std::vector<StampedPose>& truth, const TrackOptions& options);

struct TrackReport {
  /// What was compared, in words.
  std::string estimate;
  std::string truth;
  TrackOptions options;
  std::vector<TrackScore> tracks;
  /// nullopt when no loops were given, or there are no times.
  std::optional<LoopResult> loops;
  std::vector<std::string> notes;
};

std::string TrackReportToText(const TrackReport& report);
/// Names as in docs/evaluation.md; SI units and degrees, shares from 0 to 1.
std::string TrackReportToJson(const TrackReport& report);

/// "se3", "yaw", "sim3", "none".
const char* NameOf(Alignment alignment);
/// "interpolate", "nearest", "rows".
const char* NameOf(Pairing pairing);

}  // namespace dsg::evaluation
