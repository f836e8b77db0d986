// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/humans.h"

#include <algorithm>
#include <set>
#include <utility>

#include "schema/matching/assignment.h"

namespace dsg::evaluation {
namespace {

using TrackStamp = std::pair<TimeNs, int>;
using HumanStamp = std::pair<TimeNs, int>;

/// Mean over humans of a human's mean error, so that one often seen does not outweigh the rest.
class MeanOverHumans {
 public:
  void Add(int human, double error) {
    auto& [sum, count] = of_human_[human];
    sum += error;
    ++count;
  }
  std::optional<double> Mean() const {
    if (of_human_.empty()) return std::nullopt;
    double total = 0.0;
    for (const auto& [human, errors] : of_human_) {
      total += errors.first / static_cast<double>(errors.second);
    }
    return total / static_cast<double>(of_human_.size());
  }

 private:
  std::map<int, std::pair<double, int64_t>> of_human_;
};

template <typename Item>
std::map<TimeNs, std::vector<const Item*>> ByStamp(const std::vector<Item>& items) {
  std::map<TimeNs, std::vector<const Item*>> out;
  for (const Item& item : items) out[item.time_ns].push_back(&item);
  return out;
}

using Explanations = std::map<TrackStamp, std::pair<const EstimatedPrior*, const TrueDetection*>>;

// Which detection made the pose of a track at a stamp.
Explanations Explain(const std::vector<TrueDetection>& detections,
                     const std::vector<EstimatedPrior>& priors, double gate_m) {
  Explanations out;
  const auto detections_at = ByStamp(detections);
  for (const auto& [time_ns, stamped] : ByStamp(priors)) {
    const auto found = detections_at.find(time_ns);
    if (found == detections_at.end()) continue;
    Eigen::MatrixXd cost(static_cast<Eigen::Index>(stamped.size()),
                         static_cast<Eigen::Index>(found->second.size()));
    for (Eigen::Index i = 0; i < cost.rows(); ++i) {
      for (Eigen::Index j = 0; j < cost.cols(); ++j) {
        cost(i, j) = (stamped[static_cast<size_t>(i)]->torso_true_map -
                      found->second[static_cast<size_t>(j)]->detected_torso_map)
                         .norm();
      }
    }
    const std::vector<int> assigned = GatedAssignment(cost, gate_m);
    for (size_t i = 0; i < assigned.size(); ++i) {
      if (assigned[i] < 0) continue;
      out[{time_ns, stamped[i]->track}] = {stamped[i],
                                           found->second[static_cast<size_t>(assigned[i])]};
    }
  }
  return out;
}

/// Who was there to be tracked, and which track had whom.
struct Tally {
  std::set<HumanStamp> truth;
  /// (human, track) to stamps.
  std::map<std::pair<int, int>, int64_t> hits;
  /// By stamp: human to the first track that has it then.
  std::map<TimeNs, std::map<int, int>> track_of;
  std::map<int, std::set<int>> tracks_of_human;
  /// Poses that count, all of them.
  int64_t pose_count = 0;
};

void AddPose(const EstimatedTorso& pose, const Explanations& explanations, Tally* tally,
             MeanOverHumans* tracked, HumanResult* result) {
  const auto found = explanations.find({pose.time_ns, pose.track});
  const bool is_of_somebody = found != explanations.end() && found->second.second->human >= 0;
  if (!is_of_somebody) {
    ++result->unexplained_pose_count;
    ++tally->pose_count;
    return;
  }
  const TrueDetection& detection = *found->second.second;
  tracked->Add(detection.human, (pose.torso_map - detection.torso_map).norm());
  ++result->scored_pose_count;
  tally->tracks_of_human[detection.human].insert(pose.track);
  if (!tally->truth.contains({pose.time_ns, detection.human})) return;
  ++tally->pose_count;
  ++tally->hits[{detection.human, pose.track}];
  tally->track_of[pose.time_ns].emplace(detection.human, pose.track);
}

int64_t IdTruePositives(const Tally& tally) {
  std::map<int, Eigen::Index> rows;
  std::map<int, Eigen::Index> columns;
  for (const auto& [pair, count] : tally.hits) {
    rows.emplace(pair.first, static_cast<Eigen::Index>(rows.size()));
    columns.emplace(pair.second, static_cast<Eigen::Index>(columns.size()));
  }
  Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()),
                                                 static_cast<Eigen::Index>(columns.size()));
  for (const auto& [pair, count] : tally.hits) {
    weight(rows[pair.first], columns[pair.second]) = static_cast<double>(count);
  }
  double total = 0.0;
  const std::vector<int> assigned = MaximumAssignment(weight);
  for (size_t row = 0; row < assigned.size(); ++row) {
    if (assigned[row] >= 0) total += weight(static_cast<Eigen::Index>(row), assigned[row]);
  }
  return static_cast<int64_t>(total + 0.5);
}

void ScoreIdentities(const Tally& tally, HumanResult* result) {
  const auto truth_count = static_cast<int64_t>(tally.truth.size());
  if (truth_count == 0) return;
  std::map<int, int> last_track;
  int64_t matched_count = 0;
  for (const auto& [time_ns, tracks] : tally.track_of) {
    for (const auto& [human, track] : tracks) {
      ++matched_count;
      const auto [last, is_first] = last_track.emplace(human, track);
      if (!is_first && last->second != track) ++result->id_switch_count;
      last->second = track;
    }
  }
  result->idf1 = 2.0 * static_cast<double>(IdTruePositives(tally)) /
                 static_cast<double>(truth_count + tally.pose_count);
  const int64_t misses = truth_count - matched_count;
  const int64_t false_count = tally.pose_count - matched_count;
  result->mota = 1.0 - static_cast<double>(misses + false_count + result->id_switch_count) /
                           static_cast<double>(truth_count);
  if (tally.tracks_of_human.empty()) return;
  size_t track_count = 0;
  for (const auto& [human, tracks] : tally.tracks_of_human) track_count += tracks.size();
  result->tracks_per_human =
      static_cast<double>(track_count) / static_cast<double>(tally.tracks_of_human.size());
}

std::map<int, int> MajorityHumans(const Explanations& explanations) {
  std::map<int, std::map<int, int64_t>> votes;
  for (const auto& [track_stamp, explanation] : explanations) {
    if (explanation.second->human >= 0) {
      ++votes[track_stamp.second][explanation.second->human];
    }
  }
  std::map<int, int> out;
  for (const auto& [track, counts] : votes) {
    out[track] = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
                   return a.second < b.second;
                 })->first;
  }
  return out;
}

}  // namespace

HumanResult EvaluateHumans(const std::vector<TrueDetection>& detections,
                           const std::vector<EstimatedPrior>& priors,
                           const std::vector<EstimatedTorso>& poses, const HumanOptions& options) {
  HumanResult result;
  MeanOverHumans raw;
  MeanOverHumans filtered;
  MeanOverHumans tracked;
  Tally tally;
  for (const TrueDetection& detection : detections) {
    if (detection.human < 0) continue;
    ++result.detection_count;
    raw.Add(detection.human, (detection.detected_torso_map - detection.torso_map).norm());
    if (detection.visibility > options.visibility_min) {
      tally.truth.emplace(detection.time_ns, detection.human);
    }
  }
  const Explanations explanations = Explain(detections, priors, options.prior_gate_m);
  for (const auto& [track_stamp, explanation] : explanations) {
    const auto& [prior, detection] = explanation;
    if (detection->human < 0) continue;
    ++result.filtered_count;
    filtered.Add(detection->human, (prior->torso_map - detection->torso_map).norm());
    result.detection_of.emplace(track_stamp, detection->id);
  }
  result.raw_m = raw.Mean();
  result.filtered_m = filtered.Mean();
  result.human_of_track = MajorityHumans(explanations);
  // Without priors nothing says whose a pose is, and without poses there is no tracker.
  if (priors.empty() || poses.empty()) return result;
  for (const EstimatedTorso& pose : poses) {
    AddPose(pose, explanations, &tally, &tracked, &result);
  }
  result.tracked_m = tracked.Mean();
  ScoreIdentities(tally, &result);
  return result;
}

}  // namespace dsg::evaluation
