// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/trajectory.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "schema/model/rotation.h"

namespace dsg::evaluation {
namespace {

constexpr size_t kPairCountMin = 3;
// 95 % of a chi-square of three degrees of freedom and of one are below.
constexpr double kPositionBound = 7.814727903251179;
constexpr double kYawBound = 3.841458820694124;

double MedianOf(const std::vector<double>& ascending) {
  const size_t half = ascending.size() / 2;
  return ascending.size() % 2 == 1 ? ascending[half]
                                   : 0.5 * (ascending[half - 1] + ascending[half]);
}

/// What the estimate says more of a motion than there was.
Pose3d MotionError(const PosePair& from, const PosePair& to) {
  const Pose3d moved_truth = from.truth.Inverse() * to.truth;
  const Pose3d moved_estimate = from.estimate.Inverse() * to.estimate;
  return moved_truth.Inverse() * moved_estimate;
}

double AngleOf(const Pose3d& motion) {
  return AngleBetween(Eigen::Quaterniond::Identity(), motion.orientation);
}

std::vector<double> TruePathAt(const std::vector<PosePair>& pairs) {
  std::vector<double> path_m(pairs.size(), 0.0);
  for (size_t i = 1; i < pairs.size(); ++i) {
    path_m[i] = path_m[i - 1] + (pairs[i].truth.position - pairs[i - 1].truth.position).norm();
  }
  return path_m;
}

/// Yaw and position of the estimate are the true ones at this pair.
Pose3d AgreeingAt(const PosePair& pair) {
  const Eigen::Matrix3d turn =
      (pair.truth.orientation * pair.estimate.orientation.conjugate()).toRotationMatrix();
  const double yaw = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
  Pose3d truth_T_estimate;
  truth_T_estimate.orientation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  truth_T_estimate.position =
      pair.truth.position - truth_T_estimate.orientation * pair.estimate.position;
  return truth_T_estimate;
}

Eigen::Matrix<double, 6, 6> WholeMatrix(const Covariance6& upper) {
  Eigen::Matrix<double, 6, 6> matrix;
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      matrix(row, column) = matrix(column, row) = static_cast<double>(upper[next++]);
    }
  }
  return matrix;
}

/// Error squares of one pose.
struct ErrorSquares {
  double position = 0.0;
  double yaw = 0.0;
};

/// nullopt if the covariance has no inverse.
std::optional<ErrorSquares> NormalizedSquares(const PosePair& pair,
                                              const Pose3d& truth_T_estimate) {
  const Eigen::Matrix<double, 6, 6> covariance = WholeMatrix(*pair.covariance);
  const Pose3d believed = truth_T_estimate * pair.estimate;
  // Translation is in the axes of the estimate's map, rotation in those of the body.
  const Eigen::Matrix3d map_turn = truth_T_estimate.orientation.toRotationMatrix();
  const Eigen::Matrix3d position_covariance =
      map_turn * covariance.topLeftCorner<3, 3>() * map_turn.transpose();
  const Eigen::Vector3d up_body = believed.orientation.conjugate() * Eigen::Vector3d::UnitZ();
  const double yaw_variance = up_body.dot(covariance.bottomRightCorner<3, 3>() * up_body);
  const Eigen::LLT<Eigen::Matrix3d> factor(position_covariance);
  if (factor.info() != Eigen::Success || !(yaw_variance > 0.0)) return std::nullopt;
  const Eigen::Vector3d position_error = pair.truth.position - believed.position;
  const Eigen::Vector3d turn_error =
      RotationVectorOf(pair.truth.orientation * believed.orientation.conjugate());
  return ErrorSquares{position_error.dot(factor.solve(position_error)),
                      turn_error.z() * turn_error.z() / yaw_variance};
}

}  // namespace

std::optional<Pose3d> TruthAt(const std::vector<StampedPose>& truth, TimeNs time_ns,
                              TimeNs tolerance_ns, Association association) {
  const auto earlier = [](const StampedPose& pose, TimeNs t) { return pose.time_ns < t; };
  const auto after = std::lower_bound(truth.begin(), truth.end(), time_ns, earlier);
  if (after != truth.end() && after->time_ns == time_ns) return after->map_T_body;
  const bool is_first = after == truth.begin();
  if (association == Association::kNearest) {
    const StampedPose* nearest = after == truth.end() ? nullptr : &*after;
    if (!is_first) {
      const StampedPose& before = *(after - 1);
      const bool is_nearer =
          nearest == nullptr || time_ns - before.time_ns <= nearest->time_ns - time_ns;
      if (is_nearer) nearest = &before;
    }
    if (nearest == nullptr || std::abs(nearest->time_ns - time_ns) > tolerance_ns) {
      return std::nullopt;
    }
    return nearest->map_T_body;
  }
  if (is_first || after == truth.end()) return std::nullopt;
  const StampedPose& before = *(after - 1);
  const TimeNs gap_ns = after->time_ns - before.time_ns;
  if (gap_ns > tolerance_ns) return std::nullopt;
  const double fraction =
      static_cast<double>(time_ns - before.time_ns) / static_cast<double>(gap_ns);
  return Interpolate(before.map_T_body, after->map_T_body, fraction);
}

std::vector<PosePair> AssociatePoses(const std::vector<StampedPose>& estimate,
                                     const std::vector<StampedPose>& truth, TimeNs tolerance_ns,
                                     Association association) {
  std::vector<PosePair> pairs;
  for (const StampedPose& pose : estimate) {
    const std::optional<Pose3d> real = TruthAt(truth, pose.time_ns, tolerance_ns, association);
    if (real.has_value()) {
      pairs.push_back({pose.time_ns, pose.map_T_body, *real, pose.covariance});
    }
  }
  return pairs;
}

std::vector<PosePair> AssociateRows(const std::vector<StampedPose>& estimate,
                                    const std::vector<StampedPose>& truth) {
  std::vector<PosePair> pairs;
  for (size_t i = 0; i < estimate.size(); ++i) {
    const StampedPose& pose = estimate[i];
    pairs.push_back({pose.time_ns, pose.map_T_body, truth[i].map_T_body, pose.covariance});
  }
  return pairs;
}

Similarity TruthFromEstimate(const std::vector<PosePair>& pairs, Alignment alignment) {
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const PosePair& pair : pairs) {
    estimate.push_back(pair.estimate.position);
    truth.push_back(pair.truth.position);
  }
  return FitSimilarity(estimate, truth, alignment);
}

std::vector<PosePair> Aligned(const Similarity& truth_T_estimate, std::vector<PosePair> pairs) {
  for (PosePair& pair : pairs) {
    pair.estimate = truth_T_estimate * pair.estimate;
    pair.covariance = nullptr;
  }
  return pairs;
}

std::optional<AteResult> AbsoluteError(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (pairs.size() < kPairCountMin) return std::nullopt;
  const Similarity truth_T_estimate = TruthFromEstimate(pairs, alignment);
  std::vector<double> errors;
  double squares = 0.0;
  for (const PosePair& pair : pairs) {
    errors.push_back((truth_T_estimate * pair.estimate.position - pair.truth.position).norm());
    squares += errors.back() * errors.back();
  }
  std::sort(errors.begin(), errors.end());
  return AteResult{std::sqrt(squares / static_cast<double>(errors.size())), MedianOf(errors),
                   errors.back()};
}

std::optional<RpeResult> RelativeError(const std::vector<PosePair>& pairs, double length_m) {
  const std::vector<double> path_m = TruePathAt(pairs);
  RpeResult result{length_m};
  size_t end = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    while (end < pairs.size() && path_m[end] - path_m[i] < length_m) ++end;
    if (end == pairs.size()) break;
    const Pose3d error = MotionError(pairs[i], pairs[end]);
    result.translation_percent += 100.0 * error.position.norm() / length_m;
    result.rotation_deg_per_m += kDegreesPerRadian * AngleOf(error) / length_m;
    ++result.segment_count;
  }
  if (result.segment_count == 0) return std::nullopt;
  result.translation_percent /= static_cast<double>(result.segment_count);
  result.rotation_deg_per_m /= static_cast<double>(result.segment_count);
  return result;
}

std::optional<RpeTimeResult> RelativeErrorOverTime(const std::vector<PosePair>& pairs,
                                                   TimeNs duration_ns, TimeNs tolerance_ns) {
  RpeTimeResult result{duration_ns};
  size_t end = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    while (end < pairs.size() && pairs[end].time_ns - pairs[i].time_ns < duration_ns) ++end;
    if (end == pairs.size()) break;
    if (pairs[end].time_ns - pairs[i].time_ns - duration_ns > tolerance_ns) continue;
    const Pose3d error = MotionError(pairs[i], pairs[end]);
    const double degrees = kDegreesPerRadian * AngleOf(error);
    result.rmse_m += error.position.squaredNorm();
    result.rmse_deg += degrees * degrees;
    ++result.segment_count;
  }
  if (result.segment_count == 0) return std::nullopt;
  result.rmse_m = std::sqrt(result.rmse_m / static_cast<double>(result.segment_count));
  result.rmse_deg = std::sqrt(result.rmse_deg / static_cast<double>(result.segment_count));
  return result;
}

std::optional<NeesResult> Nees(const std::vector<PosePair>& pairs) {
  NeesResult result;
  for (size_t i = 1; i < pairs.size(); ++i) {
    if (pairs[i].covariance == nullptr) continue;
    const auto squares = NormalizedSquares(pairs[i], AgreeingAt(pairs.front()));
    if (!squares.has_value()) {
      ++result.singular_count;
      continue;
    }
    ++result.pose_count;
    result.position_mean += squares->position;
    result.yaw_mean += squares->yaw;
    result.position_within += squares->position <= kPositionBound ? 1.0 : 0.0;
    result.yaw_within += squares->yaw <= kYawBound ? 1.0 : 0.0;
  }
  if (result.pose_count == 0) return std::nullopt;
  for (double* sum :
       {&result.position_mean, &result.yaw_mean, &result.position_within, &result.yaw_within}) {
    *sum /= static_cast<double>(result.pose_count);
  }
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

double TruePathLength(const std::vector<PosePair>& pairs) {
  return pairs.empty() ? 0.0 : TruePathAt(pairs).back();
}

}  // namespace dsg::evaluation
