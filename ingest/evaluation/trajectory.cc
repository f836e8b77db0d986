// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/trajectory.h"

#include <algorithm>
#include <cmath>

namespace dsg::evaluation {
namespace {

constexpr size_t kPairCountMin = 3;

}  // namespace

std::vector<PosePair> AssociatePoses(const std::vector<StampedPose>& estimate,
                                     const std::vector<StampedPose>& truth, TimeNs gap_ns_max) {
  std::vector<PosePair> pairs;
  const auto earlier = [](const StampedPose& pose, TimeNs t) { return pose.time_ns < t; };
  auto after = truth.begin();
  for (const StampedPose& pose : estimate) {
    after = std::lower_bound(after, truth.end(), pose.time_ns, earlier);
    if (after == truth.end()) break;
    if (after->time_ns == pose.time_ns) {
      pairs.push_back({pose.time_ns, pose.map_T_body, after->map_T_body});
      continue;
    }
    if (after == truth.begin()) continue;
    const StampedPose& before = *(after - 1);
    const TimeNs gap_ns = after->time_ns - before.time_ns;
    if (gap_ns > gap_ns_max) continue;
    const double fraction =
        static_cast<double>(pose.time_ns - before.time_ns) / static_cast<double>(gap_ns);
    pairs.push_back({pose.time_ns, pose.map_T_body,
                     Interpolate(before.map_T_body, after->map_T_body, fraction)});
  }
  return pairs;
}

std::optional<AteResult> AbsoluteError(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (pairs.size() < kPairCountMin) return std::nullopt;
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const PosePair& pair : pairs) {
    estimate.push_back(pair.estimate.position);
    truth.push_back(pair.truth.position);
  }
  const Pose3d truth_T_estimate = FitRigid(estimate, truth, alignment);
  std::vector<double> errors;
  double squares = 0.0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    errors.push_back((truth_T_estimate * estimate[i] - truth[i]).norm());
    squares += errors.back() * errors.back();
  }
  std::sort(errors.begin(), errors.end());
  return AteResult{std::sqrt(squares / static_cast<double>(errors.size())),
                   errors[errors.size() / 2], errors.back()};
}

std::optional<RpeResult> RelativeError(const std::vector<PosePair>& pairs, double length_m) {
  std::vector<double> path_m(pairs.size(), 0.0);
  for (size_t i = 1; i < pairs.size(); ++i) {
    path_m[i] = path_m[i - 1] + (pairs[i].truth.position - pairs[i - 1].truth.position).norm();
  }
  RpeResult result{length_m};
  size_t end = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    while (end < pairs.size() && path_m[end] - path_m[i] < length_m) ++end;
    if (end == pairs.size()) break;
    const Pose3d moved_truth = pairs[i].truth.Inverse() * pairs[end].truth;
    const Pose3d moved_estimate = pairs[i].estimate.Inverse() * pairs[end].estimate;
    const Pose3d error = moved_truth.Inverse() * moved_estimate;
    result.translation_percent += 100.0 * error.position.norm() / length_m;
    result.rotation_deg_per_m += kDegreesPerRadian *
                                 AngleBetween(Eigen::Quaterniond::Identity(), error.orientation) /
                                 length_m;
    ++result.segment_count;
  }
  if (result.segment_count == 0) return std::nullopt;
  result.translation_percent /= static_cast<double>(result.segment_count);
  result.rotation_deg_per_m /= static_cast<double>(result.segment_count);
  return result;
}

double Coverage(const std::vector<StampedPose>& estimate, TimeNs begin_ns, TimeNs end_ns,
                TimeNs reach_ns) {
  if (end_ns <= begin_ns) return 0.0;
  TimeNs covered_ns = 0;
  TimeNs until_ns = begin_ns;
  for (const StampedPose& pose : estimate) {
    if (pose.time_ns < begin_ns || pose.time_ns > end_ns) continue;
    const TimeNs from_ns = std::max(until_ns, pose.time_ns - reach_ns);
    const TimeNs to_ns = std::min(end_ns, pose.time_ns + reach_ns);
    covered_ns += std::max<TimeNs>(0, to_ns - from_ns);
    until_ns = std::max(until_ns, to_ns);
  }
  return static_cast<double>(covered_ns) / static_cast<double>(end_ns - begin_ns);
}

}  // namespace dsg::evaluation
