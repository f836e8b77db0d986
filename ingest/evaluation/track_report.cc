// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/track_report.h"

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace dsg::evaluation {
namespace {

using TrackJson = nlohmann::ordered_json;

double SecondsOf(TimeNs time_ns) {
  return static_cast<double>(time_ns) / static_cast<double>(kNsPerSecond);
}

template <typename T>
TrackJson ValueOrNull(const std::optional<T>& value) {
  return value.has_value() ? TrackJson(*value) : TrackJson(nullptr);
}

TrackJson AteJson(const TrackScore& score) {
  if (!score.ate.has_value()) return nullptr;
  return {{"rmse_m", score.ate->rmse_m},
          {"median_m", score.ate->median_m},
          {"max_m", score.ate->max_m}};
}

TrackJson AlignmentJson(const TrackScore& score) {
  if (!score.truth_T_estimate.has_value()) return nullptr;
  const Pose3d& pose = score.truth_T_estimate->target_T_source;
  const Eigen::Vector3d& t = pose.position;
  const Eigen::Quaterniond& q = pose.orientation;
  return {{"scale", score.truth_T_estimate->scale},
          {"translation", {t.x(), t.y(), t.z()}},
          {"rotation", {q.x(), q.y(), q.z(), q.w()}}};
}

TrackJson NeesJson(const std::optional<NeesResult>& nees) {
  if (!nees.has_value()) return nullptr;
  return {{"position", nees->position_mean},
          {"yaw", nees->yaw_mean},
          {"position_within_95", nees->position_within},
          {"yaw_within_95", nees->yaw_within},
          {"pose_count", nees->pose_count},
          {"singular_count", nees->singular_count}};
}

TrackJson ScoreJsonOf(const TrackScore& score) {
  TrackJson out = {{"pose_count", score.pose_count},
                   {"pair_count", score.pair_count},
                   {"coverage", ValueOrNull(score.coverage)},
                   {"path_m", score.path_m},
                   {"ate", AteJson(score)},
                   {"truth_T_estimate", AlignmentJson(score)},
                   {"rpe", TrackJson::array()},
                   {"rpe_time", TrackJson::array()},
                   {"nees", NeesJson(score.nees)}};
  for (const RpeResult& rpe : score.rpe) {
    out["rpe"].push_back({{"length_m", rpe.length_m},
                          {"translation_percent", rpe.translation_percent},
                          {"rotation_deg_per_m", rpe.rotation_deg_per_m},
                          {"segment_count", rpe.segment_count}});
  }
  for (const RpeTimeResult& rpe : score.rpe_time) {
    out["rpe_time"].push_back({{"seconds", SecondsOf(rpe.duration_ns)},
                               {"rmse_m", rpe.rmse_m},
                               {"rmse_deg", rpe.rmse_deg},
                               {"segment_count", rpe.segment_count}});
  }
  return out;
}

TrackJson LoopsJson(const std::optional<LoopResult>& loops) {
  if (!loops.has_value()) return nullptr;
  const auto count = [](const LoopCount& of) -> TrackJson {
    return {{"judged_count", of.judged_count},
            {"right_count", of.right_count},
            {"unjudged_count", of.unjudged_count}};
  };
  return {{"precision", ValueOrNull(loops->precision)}, {"recall", ValueOrNull(loops->recall)},
          {"believed", count(loops->believed)},         {"left_out", count(loops->left_out)},
          {"revisit_count", loops->revisit_count},      {"found_count", loops->found_count}};
}

std::string HowAligned(Alignment alignment) {
  switch (alignment) {
    case Alignment::kNone:
      return "not aligned";
    case Alignment::kSe3:
      return "aligned by SE(3)";
    case Alignment::kYaw:
      return "aligned by yaw and translation";
    case Alignment::kSim3:
      return "aligned by Sim(3)";
  }
  return "";
}

std::string HowPaired(const TrackOptions& options) {
  const double seconds = SecondsOf(options.tolerance_ns);
  switch (options.pairing) {
    case Pairing::kInterpolate:
      return absl::StrFormat("truth interpolated over at most %g s", seconds);
    case Pairing::kNearest:
      return absl::StrFormat("nearest true pose within %g s", seconds);
    case Pairing::kRows:
      return "row by row";
  }
  return "";
}

void AddRow(std::string* out, const std::string& name, const std::string& value,
            const std::string& remark = "") {
  absl::StrAppend(out, absl::StrFormat("  %-34s %10s", name, value),
                  remark.empty() ? "" : "   " + remark, "\n");
}

std::string Number(const std::optional<double>& value, double scale, int decimals) {
  return value.has_value() ? absl::StrFormat("%.*f", decimals, scale * *value) : "-";
}

void AppendScore(const TrackScore& score, std::string* out) {
  absl::StrAppend(out, "Trajectory, ", score.name, "\n");
  AddRow(out, "poses compared", absl::StrCat(score.pair_count),
         absl::StrFormat("of %d, over %.1f m of path", score.pose_count, score.path_m));
  AddRow(out, "coverage (%)", Number(score.coverage, 100.0, 1));
  const auto& ate = score.ate;
  AddRow(out, "ATE, RMSE (m)", Number(ate ? std::optional(ate->rmse_m) : std::nullopt, 1.0, 4),
         score.truth_T_estimate.has_value() && score.truth_T_estimate->scale != 1.0
             ? absl::StrFormat("scale %.6g", score.truth_T_estimate->scale)
             : "");
  AddRow(out, "ATE, median (m)", Number(ate ? std::optional(ate->median_m) : std::nullopt, 1.0, 4));
  AddRow(out, "ATE, largest (m)", Number(ate ? std::optional(ate->max_m) : std::nullopt, 1.0, 4));
  for (const RpeResult& rpe : score.rpe) {
    AddRow(out, absl::StrFormat("RPE over %g m (%%)", rpe.length_m),
           absl::StrFormat("%.3f", rpe.translation_percent),
           absl::StrFormat("%.4f deg/m, %d segments", rpe.rotation_deg_per_m, rpe.segment_count));
  }
  for (const RpeTimeResult& rpe : score.rpe_time) {
    AddRow(out, absl::StrFormat("RPE over %g s (m)", SecondsOf(rpe.duration_ns)),
           absl::StrFormat("%.4f", rpe.rmse_m),
           absl::StrFormat("%.4f deg, %d segments", rpe.rmse_deg, rpe.segment_count));
  }
  if (!score.nees.has_value()) return;
  const NeesResult& nees = *score.nees;
  AddRow(out, "NEES of position (3 is right)", absl::StrFormat("%.3f", nees.position_mean),
         absl::StrFormat("%.1f %% within 95 %% of %d poses", 100.0 * nees.position_within,
                         nees.pose_count));
  AddRow(out, "NEES of yaw (1 is right)", absl::StrFormat("%.3f", nees.yaw_mean),
         absl::StrFormat("%.1f %% within 95 %%", 100.0 * nees.yaw_within));
}

void AppendLoops(const LoopResult& loops, std::string* out) {
  absl::StrAppend(out, "Loop closures\n");
  AddRow(
      out, "precision (%)", Number(loops.precision, 100.0, 1),
      absl::StrFormat("%d of %d right", loops.believed.right_count, loops.believed.judged_count));
  AddRow(out, "recall (%)", Number(loops.recall, 100.0, 1),
         absl::StrFormat("%d of %d revisits", loops.found_count, loops.revisit_count));
  AddRow(out, "left out", absl::StrCat(loops.left_out.judged_count),
         absl::StrFormat("of which %d right", loops.left_out.right_count));
  const int64_t unjudged_count = loops.believed.unjudged_count + loops.left_out.unjudged_count;
  if (unjudged_count > 0) AddRow(out, "without truth", absl::StrCat(unjudged_count));
}

}  // namespace

const char* NameOf(Alignment alignment) {
  switch (alignment) {
    case Alignment::kNone:
      return "none";
    case Alignment::kSe3:
      return "se3";
    case Alignment::kYaw:
      return "yaw";
    case Alignment::kSim3:
      return "sim3";
  }
  return "";
}

const char* NameOf(Pairing pairing) {
  switch (pairing) {
    case Pairing::kInterpolate:
      return "interpolate";
    case Pairing::kNearest:
      return "nearest";
    case Pairing::kRows:
      return "rows";
  }
  return "";
}

TrackScore ScoreTrack(const std::string& name, const std::vector<StampedPose>& estimate,
                      const std::vector<StampedPose>& truth, const TrackOptions& options) {
  const bool is_by_rows = options.pairing == Pairing::kRows;
  const std::vector<PosePair> pairs =
      is_by_rows ? AssociateRows(estimate, truth)
                 : AssociatePoses(estimate, truth, options.tolerance_ns,
                                  options.pairing == Pairing::kNearest ? Association::kNearest
                                                                       : Association::kInterpolate);
  TrackScore score;
  score.name = name;
  score.pose_count = static_cast<int64_t>(estimate.size());
  score.pair_count = static_cast<int64_t>(pairs.size());
  if (!is_by_rows && !truth.empty()) {
    score.coverage =
        Coverage(estimate, truth.front().time_ns, truth.back().time_ns, options.reach_ns);
  }
  score.path_m = TruePathLength(pairs);
  score.ate = AbsoluteError(pairs, options.alignment);
  if (!score.ate.has_value()) return score;
  score.truth_T_estimate = TruthFromEstimate(pairs, options.alignment);
  score.nees = Nees(pairs);
  // A scale changes relative errors too.
  const std::vector<PosePair> aligned = Aligned(*score.truth_T_estimate, pairs);
  for (const double length_m : options.rpe_lengths_m) {
    if (const auto rpe = RelativeError(aligned, length_m)) score.rpe.push_back(*rpe);
  }
  if (is_by_rows) return score;
  for (const TimeNs duration_ns : options.rpe_durations_ns) {
    const auto rpe = RelativeErrorOverTime(aligned, duration_ns, options.tolerance_ns);
    if (rpe.has_value()) score.rpe_time.push_back(*rpe);
  }
  return score;
}

std::string TrackReportToText(const TrackReport& report) {
  std::string out =
      absl::StrCat(report.estimate, "\nagainst ", report.truth, "\n",
                   HowAligned(report.options.alignment), "; ", HowPaired(report.options),
                   report.options.until_ns.has_value()
                       ? absl::StrFormat("; the first %g s", SecondsOf(*report.options.until_ns))
                       : "",
                   "\n\n");
  for (const TrackScore& score : report.tracks) AppendScore(score, &out);
  if (report.loops.has_value()) AppendLoops(*report.loops, &out);
  for (const std::string& note : report.notes) absl::StrAppend(&out, "note: ", note, "\n");
  return out;
}

std::string TrackReportToJson(const TrackReport& report) {
  TrackJson out = {{"estimate", report.estimate},
                   {"truth", report.truth},
                   {"align", NameOf(report.options.alignment)},
                   {"associate", NameOf(report.options.pairing)},
                   {"tolerance_s", SecondsOf(report.options.tolerance_ns)},
                   {"until_s", report.options.until_ns.has_value()
                                   ? TrackJson(SecondsOf(*report.options.until_ns))
                                   : TrackJson(nullptr)},
                   {"tracks", TrackJson::object()},
                   {"loops", LoopsJson(report.loops)},
                   {"notes", report.notes}};
  for (const TrackScore& score : report.tracks) out["tracks"][score.name] = ScoreJsonOf(score);
  // Names come from files.
  return out.dump(2, ' ', false, TrackJson::error_handler_t::replace) + "\n";
}

}  // namespace dsg::evaluation
