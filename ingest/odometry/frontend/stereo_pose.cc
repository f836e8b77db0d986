// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/stereo_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/consensus.h"
#include "ingest/odometry/frontend/rotation_fit_internal.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Sine of the angle at a corner of a sample: flatter triangles tell no rotation. A condition of the
// arithmetic, no option.
constexpr double kTriangleSineMin = 0.02;

bool IsUsable(const StereoPoint& point) {
  if (!point.point.allFinite() || !point.covariance.allFinite()) return false;
  return Eigen::LLT<Eigen::Matrix3d>(point.covariance).info() == Eigen::Success;
}

struct PointSearch {
  std::vector<StereoPointPair> pairs;
  // Where each was among those given.
  std::vector<int> given;
};

PointSearch PointsAmong(std::span<const StereoPointPair> pairs) {
  PointSearch search;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (!IsUsable(pairs[i].first) || !IsUsable(pairs[i].second)) continue;
    search.pairs.push_back(pairs[i]);
    search.given.push_back(static_cast<int>(i));
  }
  return search;
}

// Inverse covariances of what the pairs miss a motion by, which depend on its rotation only.
using Weights = std::vector<Eigen::Matrix3d>;

std::shared_ptr<const Weights> WeightsOf(const PointSearch& search, const Eigen::Matrix3d& turn) {
  auto weights = std::make_shared<Weights>();
  for (const StereoPointPair& pair : search.pairs) {
    const Eigen::Matrix3d turned = turn * pair.second.covariance * turn.transpose();
    weights->push_back((pair.first.covariance + turned).inverse());
  }
  return weights;
}

// first = turn * second + shift.
struct RigMotion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  std::shared_ptr<const Weights> weights;
  // Sum of CostOfDistance of all pairs.
  double cost = std::numeric_limits<double>::infinity();
  int agree_count = 0;
};

// What the pair `i` misses a motion by.
struct Residual {
  Eigen::Vector3d error;
  double chi_square;
};

Residual ResidualOf(const PointSearch& search, const RigMotion& motion, size_t i) {
  const StereoPointPair& pair = search.pairs[i];
  Residual residual;
  residual.error = pair.first.point - motion.turn * pair.second.point - motion.shift;
  residual.chi_square = residual.error.dot((*motion.weights)[i] * residual.error);
  return residual;
}

// Of a squared distance in units of its covariance: grows with it up to the gate, and up to 1.
double CostOfDistance(double chi_square, const RelativePoseOptions& options) {
  return chi_square / (chi_square + options.chi_square_max);
}

// Not found, with infinite cost, if it costs more than `limit`.
RigMotion ScoredMotion(const PointSearch& search, const Eigen::Matrix3d& turn,
                       const Eigen::Vector3d& shift, std::shared_ptr<const Weights> weights,
                       const RelativePoseOptions& options,
                       double limit = std::numeric_limits<double>::infinity()) {
  RigMotion motion{turn, shift, std::move(weights), 0.0, 0};
  for (size_t i = 0; i < search.pairs.size(); ++i) {
    const double chi_square = ResidualOf(search, motion, i).chi_square;
    motion.cost += CostOfDistance(chi_square, options);
    if (motion.cost > limit) return {};
    if (chi_square <= options.chi_square_max) ++motion.agree_count;
  }
  return motion;
}

// The numbers are a small turn on the left of the rotation, then the shift.
struct NormalEquations {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d right_side = Vector6d::Zero();
};

// Of all pairs, weighted as CostOfDistance does, or of those that agree, as they are.
NormalEquations EquationsOf(const PointSearch& search, const RigMotion& motion, bool is_robust,
                            const RelativePoseOptions& options) {
  NormalEquations equations;
  for (size_t i = 0; i < search.pairs.size(); ++i) {
    const Residual residual = ResidualOf(search, motion, i);
    if (!is_robust && residual.chi_square > options.chi_square_max) continue;
    const double share = is_robust ? 1.0 - CostOfDistance(residual.chi_square, options) : 1.0;
    const Eigen::Matrix3d weight = share * share * (*motion.weights)[i];
    const Eigen::Vector3d turned = motion.turn * search.pairs[i].second.point;
    Eigen::Matrix<double, 3, 6> gradient;
    gradient << 0.0, -turned.z(), turned.y(), -1.0, 0.0, 0.0,  //
        turned.z(), 0.0, -turned.x(), 0.0, -1.0, 0.0,          //
        -turned.y(), turned.x(), 0.0, 0.0, 0.0, -1.0;
    equations.matrix += gradient.transpose() * weight * gradient;
    equations.right_side -= gradient.transpose() * weight * residual.error;
  }
  return equations;
}

Vector6d StepOfPoints(const NormalEquations& equations, bool is_turn_free) {
  if (is_turn_free) return equations.matrix.ldlt().solve(equations.right_side);
  Vector6d step = Vector6d::Zero();
  step.tail<3>() =
      equations.matrix.bottomRightCorner<3, 3>().ldlt().solve(equations.right_side.tail<3>());
  return step;
}

// The motion after a step of its normal equations; itself if they have no solution.
RigMotion Stepped(const PointSearch& search, const RigMotion& motion, bool is_robust,
                  bool is_turn_free, const RelativePoseOptions& options) {
  const Vector6d step = StepOfPoints(EquationsOf(search, motion, is_robust, options), is_turn_free);
  if (!step.allFinite()) return motion;
  Eigen::Matrix3d turn = motion.turn;
  std::shared_ptr<const Weights> weights = motion.weights;
  if (!step.head<3>().isZero(0.0)) {
    turn = RotationOf(step.head<3>()).toRotationMatrix() * turn;
    weights = WeightsOf(search, turn);
  }
  return ScoredMotion(search, turn, motion.shift + step.tail<3>(), std::move(weights), options);
}

RigMotion RefinedMotion(const PointSearch& search, RigMotion motion, bool is_turn_free,
                        const RelativePoseOptions& options) {
  for (int i = 0; i < options.refine_count; ++i) {
    RigMotion next = Stepped(search, motion, /*is_robust=*/true, is_turn_free, options);
    if (next.cost >= motion.cost) break;
    motion = std::move(next);
  }
  return motion;
}

bool IsTriangle(const std::array<Eigen::Vector3d, 3>& corners) {
  const Eigen::Vector3d a = corners[1] - corners[0];
  const Eigen::Vector3d b = corners[2] - corners[0];
  const Eigen::Vector3d c = corners[2] - corners[1];
  const double area = a.cross(b).norm();
  return area > kTriangleSineMin * std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
}

// The rotation of least squares of three points of `first` from those of `second`.
Eigen::Matrix3d TurnOfTriangle(const std::array<Eigen::Vector3d, 3>& first,
                               const std::array<Eigen::Vector3d, 3>& second) {
  const Eigen::Vector3d first_mean = (first[0] + first[1] + first[2]) / 3.0;
  const Eigen::Vector3d second_mean = (second[0] + second[1] + second[2]) / 3.0;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < 3; ++i) {
    products += (first[i] - first_mean) * (second[i] - second_mean).transpose();
  }
  return RotationOfProducts(products);
}

// Least squares of the pairs that agree, which has a covariance.
StereoPose PoseOfMotion(const PointSearch& search, RigMotion motion, bool is_turn_free,
                        const RelativePoseOptions& options) {
  StereoPose result;
  const int count = static_cast<int>(search.pairs.size());
  result.outcome = PoseOutcome::kNoConsensus;
  if (!IsConsensus(motion.agree_count, count, options.consensus)) return result;
  for (int i = 0; i < options.refine_count; ++i) {
    motion = Stepped(search, motion, /*is_robust=*/false, is_turn_free, options);
  }
  const NormalEquations equations = EquationsOf(search, motion, /*is_robust=*/false, options);
  const Eigen::Matrix3d covariance =
      is_turn_free ? Eigen::Matrix3d(equations.matrix.inverse().bottomRightCorner<3, 3>())
                   : Eigen::Matrix3d(equations.matrix.bottomRightCorner<3, 3>().inverse());
  // Points in line leave a rotation open.
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0.0) return result;
  result.outcome = PoseOutcome::kFound;
  result.first_T_second = {motion.shift, Eigen::Quaterniond(motion.turn).normalized()};
  result.position_covariance = 0.5 * (covariance + covariance.transpose());
  for (size_t i = 0; i < search.pairs.size(); ++i) {
    if (ResidualOf(search, motion, i).chi_square <= options.chi_square_max) {
      result.inliers.push_back(search.given[i]);
    }
  }
  return result;
}

}  // namespace

StereoPoint StereoPointOf(const CameraCalibration& left, double baseline_m,
                          const Eigen::Vector2d& pixel, double disparity_px,
                          const RelativePoseOptions& options) {
  const double depth_m = left.fx * std::abs(baseline_m) / disparity_px;
  StereoPoint result;
  result.point = depth_m * Eigen::Vector3d((pixel.x() - left.cx) / left.fx,
                                           (pixel.y() - left.cy) / left.fy, 1.0);
  Eigen::Matrix3d gradient;
  gradient.col(0) = Eigen::Vector3d(depth_m / left.fx, 0.0, 0.0);
  gradient.col(1) = Eigen::Vector3d(0.0, depth_m / left.fy, 0.0);
  gradient.col(2) = -result.point / disparity_px;
  const Eigen::Vector3d sigma(options.pixel_sigma_px, options.pixel_sigma_px,
                              options.disparity_sigma_px);
  result.covariance = gradient * sigma.cwiseAbs2().asDiagonal() * gradient.transpose();
  return result;
}

absl::StatusOr<StereoPoseMethod> ParseStereoPoseMethod(std::string_view name) {
  if (name == "3pt") return StereoPoseMethod::kThreePoint;
  if (name == "1pt") return StereoPoseMethod::kOnePoint;
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("no method finds poses of a stereo rig by the name \"",
                                std::string(name), "\"; give 3pt or 1pt"),
                   {{"field", "stereo_pose"}, {"value", std::string(name)}});
}

StereoPose ThreePointPose(std::span<const StereoPointPair> pairs,
                          const RelativePoseOptions& options) {
  constexpr int kSampleSize = 3;
  const PointSearch search = PointsAmong(pairs);
  const int count = static_cast<int>(search.pairs.size());
  if (count < kSampleSize) return {};
  RigMotion best;
  SampleDraws draws(count, kSampleSize, options.consensus);
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    std::array<Eigen::Vector3d, 3> first;
    std::array<Eigen::Vector3d, 3> second;
    for (size_t i = 0; i < 3; ++i) {
      const StereoPointPair& pair = search.pairs[static_cast<size_t>(sample[i])];
      first[i] = pair.first.point;
      second[i] = pair.second.point;
    }
    if (!IsTriangle(first) || !IsTriangle(second)) continue;
    const Eigen::Matrix3d turn = TurnOfTriangle(first, second);
    const Eigen::Vector3d shift =
        (first[0] + first[1] + first[2] - turn * (second[0] + second[1] + second[2])) / 3.0;
    // Three points err by more than most pairs do, and far ones by much: a step on all pairs first.
    const RigMotion sampled = ScoredMotion(search, turn, shift, WeightsOf(search, turn), options);
    const RigMotion motion =
        Stepped(search, sampled, /*is_robust=*/true, /*is_turn_free=*/true, options);
    if (motion.cost >= best.cost) continue;
    best = RefinedMotion(search, motion, /*is_turn_free=*/true, options);
    draws.NoteAgreement(best.agree_count);
  }
  StereoPose result = PoseOfMotion(search, best, /*is_turn_free=*/true, options);
  result.draw_count = draws.drawn_count();
  return result;
}

StereoPose OnePointPose(std::span<const StereoPointPair> pairs,
                        const Eigen::Quaterniond& first_R_second,
                        const RelativePoseOptions& options) {
  const PointSearch search = PointsAmong(pairs);
  const int count = static_cast<int>(search.pairs.size());
  if (count < 1) return {};
  const Eigen::Matrix3d turn = first_R_second.toRotationMatrix();
  const std::shared_ptr<const Weights> weights = WeightsOf(search, turn);
  const int vote_count = std::min(count, options.consensus.draw_count_max);
  RigMotion best;
  for (int vote = 0; vote < vote_count; ++vote) {
    const auto at = static_cast<size_t>(int64_t{vote} * count / vote_count);
    const StereoPointPair& pair = search.pairs[at];
    const RigMotion motion = ScoredMotion(search, turn, pair.first.point - turn * pair.second.point,
                                          weights, options, best.cost);
    if (motion.cost >= best.cost) continue;
    best = RefinedMotion(search, motion, /*is_turn_free=*/false, options);
  }
  StereoPose result = PoseOfMotion(search, best, /*is_turn_free=*/false, options);
  if (result.outcome == PoseOutcome::kFound) result.first_T_second.orientation = first_R_second;
  result.draw_count = vote_count;
  return result;
}

int CountAgreeing(std::span<const StereoPointPair> pairs, const Pose3d& first_T_second,
                  const RelativePoseOptions& options) {
  const Eigen::Matrix3d turn = first_T_second.orientation.toRotationMatrix();
  return static_cast<int>(std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
    if (!IsUsable(pair.first) || !IsUsable(pair.second)) return false;
    const Eigen::Vector3d error = pair.first.point - first_T_second * pair.second.point;
    const Eigen::Matrix3d covariance =
        pair.first.covariance + turn * pair.second.covariance * turn.transpose();
    const double chi_square = error.dot(covariance.llt().solve(error));
    return chi_square <= options.chi_square_max;
  }));
}

}  // namespace dsg::ingest
