// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/sighting_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "ingest/sensor/pinhole.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

// Points nearer than this to the plane of a camera have no projection, metres. A condition of the
// arithmetic, no option.
constexpr double kDepthMinM = 0.05;
constexpr int kSampleOfThree = 3;

Pose3d MovedOnTheRight(const Pose3d& pose, const Vector6d& twist) {
  return pose * Pose3d{twist.head<3>(), RotationOf(twist.tail<3>())};
}

// Of a pinhole at a point, by the point.
Eigen::Matrix<double, 2, 3> ProjectionGradient(const CameraCalibration& camera,
                                               const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 2, 3> gradient;
  const double inverse = 1.0 / point.z();
  gradient << camera.fx * inverse, 0.0, -camera.fx * point.x() * inverse * inverse,  //
      0.0, camera.fy * inverse, -camera.fy * point.y() * inverse * inverse;
  return gradient;
}

std::vector<cv::Point2d> OnUnitPlane(const CameraCalibration& camera,
                                     const std::vector<Eigen::Vector2d>& pixels) {
  std::vector<cv::Point2d> points;
  for (const Eigen::Vector2d& pixel : pixels) {
    const Eigen::Vector3d ray = PinholeRay(camera, pixel.x(), pixel.y());
    points.emplace_back(ray.x(), ray.y());
  }
  return points;
}

}  // namespace

// Whitened: of unit variance but for what the depth of the point adds along `along`. Rows are
// column, row and inverse depth; those that there are not are 0.
struct SightingPoseSearch::SightingError {
  bool is_before = false;
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  // By the point in the frame of the camera that sees it.
  Eigen::Matrix3d by_point = Eigen::Matrix3d::Zero();
  Eigen::Vector3d seen_point = Eigen::Vector3d::Zero();

  Eigen::Matrix3d Weight() const {
    return Eigen::Matrix3d::Identity() - along * along.transpose() / (1.0 + along.squaredNorm());
  }
  double ChiSquare() const {
    if (!is_before) return std::numeric_limits<double>::infinity();
    const double product = along.dot(error);
    return error.squaredNorm() - product * product / (1.0 + along.squaredNorm());
  }
};

struct SightingPoseSearch::ScoredPose {
  Pose3d from_T_to;
  double cost = std::numeric_limits<double>::infinity();
  int agree_count = 0;
};

struct SightingPoseSearch::PoseEquations {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d right_side = Vector6d::Zero();
  double chi_square = 0.0;
  int row_count = 0;
};

SightingPoseSearch::SightingError SightingPoseSearch::ErrorOf(const PointSighting& sighting,
                                                              const Pose3d& from_T_to,
                                                              const Pose3d& to_T_from) const {
  const Pose3d& sees_T_knows = sighting.is_forward ? to_T_from : from_T_to;
  const CameraCalibration& camera = sighting.is_forward ? to_ : from_;
  SightingError result;
  result.seen_point = sees_T_knows * sighting.point;
  const double depth_m = result.seen_point.z();
  if (!(depth_m > kDepthMinM)) return result;
  result.is_before = true;
  const double inverse = 1.0 / depth_m;
  const double sigma_px =
      std::hypot(sighting.pixel_sigma_px, sighting.aside_sigma_m * camera.fx * inverse);
  result.error.x() =
      (sighting.pixel.x() - camera.fx * result.seen_point.x() * inverse - camera.cx) / sigma_px;
  result.error.y() =
      (sighting.pixel.y() - camera.fy * result.seen_point.y() * inverse - camera.cy) / sigma_px;
  result.by_point.topRows<2>() = ProjectionGradient(camera, result.seen_point) / sigma_px;
  if (sighting.inverse_sigma > 0.0) {
    result.error.z() = (sighting.inverse_depth - inverse) / sighting.inverse_sigma;
    result.by_point(2, 2) = -inverse * inverse / sighting.inverse_sigma;
  }
  result.along = result.by_point * (sees_T_knows.orientation * sighting.depth_step);
  return result;
}

SightingPoseSearch::ScoredPose SightingPoseSearch::ScoreOf(std::span<const PointSighting> sightings,
                                                           const Pose3d& from_T_to,
                                                           double limit) const {
  const Pose3d to_T_from = from_T_to.Inverse();
  ScoredPose scored{from_T_to, 0.0, 0};
  for (const PointSighting& sighting : sightings) {
    const double chi_square = ErrorOf(sighting, from_T_to, to_T_from).ChiSquare();
    const bool agrees = chi_square <= options_.chi_square_max;
    // Grows with the distance up to the gate, and up to 1: outliers cost alike.
    scored.cost +=
        std::isfinite(chi_square) ? chi_square / (chi_square + options_.chi_square_max) : 1.0;
    if (scored.cost > limit) return {};
    if (agrees) ++scored.agree_count;
  }
  return scored;
}

SightingPoseSearch::PoseEquations SightingPoseSearch::EquationsAt(
    std::span<const PointSighting> sightings, const Pose3d& from_T_to, bool is_robust) const {
  const Pose3d to_T_from = from_T_to.Inverse();
  const Eigen::Matrix3d turn = from_T_to.orientation.toRotationMatrix();
  PoseEquations equations;
  for (const PointSighting& sighting : sightings) {
    const SightingError error = ErrorOf(sighting, from_T_to, to_T_from);
    const double chi_square = error.ChiSquare();
    if (!error.is_before || (!is_robust && chi_square > options_.chi_square_max)) continue;
    // The point that is seen, by a small motion of `to` on the right of its pose.
    Eigen::Matrix<double, 3, 6> point_by_twist;
    if (sighting.is_forward) {
      point_by_twist << -Eigen::Matrix3d::Identity(), CrossMatrix(error.seen_point);
    } else {
      point_by_twist << turn, -turn * CrossMatrix(sighting.point);
    }
    const Eigen::Matrix<double, 3, 6> gradient = error.by_point * point_by_twist;
    const double share =
        is_robust ? options_.chi_square_max / (chi_square + options_.chi_square_max) : 1.0;
    const Eigen::Matrix3d weight = share * share * error.Weight();
    equations.matrix += gradient.transpose() * weight * gradient;
    equations.right_side += gradient.transpose() * weight * error.error;
    equations.chi_square += chi_square;
    equations.row_count += sighting.inverse_sigma > 0.0 ? 3 : 2;
  }
  return equations;
}

SightingPoseSearch::ScoredPose SightingPoseSearch::Improved(
    std::span<const PointSighting> sightings, ScoredPose pose) const {
  for (int i = 0; i < options_.refine_count; ++i) {
    const PoseEquations equations = EquationsAt(sightings, pose.from_T_to, /*is_robust=*/true);
    const Vector6d step = equations.matrix.ldlt().solve(equations.right_side);
    if (!step.allFinite()) break;
    const ScoredPose next = ScoreOf(sightings, MovedOnTheRight(pose.from_T_to, step), pose.cost);
    if (!(next.cost < pose.cost)) break;
    pose = next;
  }
  return pose;
}

std::vector<Pose3d> SightingPoseSearch::PosesOfThree(std::span<const PointSighting> sightings,
                                                     std::span<const size_t> three) const {
  const bool is_forward = sightings[three.front()].is_forward;
  std::vector<cv::Point3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const size_t i : three) {
    const PointSighting& sighting = sightings[i];
    points.emplace_back(sighting.point.x(), sighting.point.y(), sighting.point.z());
    pixels.push_back(sighting.pixel);
  }
  std::vector<cv::Vec3d> turns;
  std::vector<cv::Vec3d> shifts;
  cv::solveP3P(points, OnUnitPlane(is_forward ? to_ : from_, pixels), cv::Matx33d::eye(),
               cv::noArray(), turns, shifts, cv::SOLVEPNP_AP3P);
  std::vector<Pose3d> poses;
  for (size_t i = 0; i < turns.size(); ++i) {
    const Pose3d sees_T_knows{{shifts[i][0], shifts[i][1], shifts[i][2]},
                              RotationOf({turns[i][0], turns[i][1], turns[i][2]})};
    if (!sees_T_knows.position.allFinite() || !sees_T_knows.orientation.coeffs().allFinite()) {
      continue;
    }
    poses.push_back(is_forward ? sees_T_knows.Inverse() : sees_T_knows);
  }
  return poses;
}

std::optional<Pose3d> SightingPoseSearch::Consensus(std::span<const PointSighting> sightings,
                                                    const std::optional<Pose3d>& guess,
                                                    int* draw_count) const {
  std::vector<size_t> forward;
  std::vector<size_t> backward;
  for (size_t i = 0; i < sightings.size(); ++i) {
    (sightings[i].is_forward ? forward : backward).push_back(i);
  }
  const std::vector<size_t>& kind = forward.size() >= backward.size() ? forward : backward;
  if (std::ssize(kind) < kSampleOfThree) return std::nullopt;
  SampleDraws draws(static_cast<int>(kind.size()), kSampleOfThree, options_.consensus);
  // Of the kind that is drawn at most as many are right as of all.
  const auto note = [&](const ScoredPose& pose) {
    draws.NoteAgreement(std::min(pose.agree_count, static_cast<int>(kind.size())));
  };
  ScoredPose best;
  if (guess.has_value()) {
    best = Improved(sightings, ScoreOf(sightings, *guess));
    note(best);
  }
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    std::vector<size_t> three;
    for (const int i : sample) three.push_back(kind[static_cast<size_t>(i)]);
    for (const Pose3d& pose : PosesOfThree(sightings, three)) {
      const ScoredPose scored = ScoreOf(sightings, pose, best.cost);
      if (!(scored.cost < best.cost)) continue;
      best = Improved(sightings, scored);
      note(best);
    }
  }
  *draw_count = draws.drawn_count();
  if (!IsConsensus(best.agree_count, static_cast<int>(sightings.size()), options_.consensus)) {
    return std::nullopt;
  }
  return best.from_T_to;
}

int SightingPoseSearch::AgreeCount(std::span<const PointSighting> sightings,
                                   const Pose3d& from_T_to) const {
  return ScoreOf(sightings, from_T_to).agree_count;
}

double SightingPoseSearch::ChiSquareOf(const PointSighting& sighting, const Pose3d& from_T_to,
                                       const Pose3d& to_T_from) const {
  return ErrorOf(sighting, from_T_to, to_T_from).ChiSquare();
}

std::optional<SightingPose> SightingPoseSearch::Refined(std::span<const PointSighting> sightings,
                                                        const Pose3d& start) const {
  ScoredPose pose = Improved(sightings, ScoreOf(sightings, start));
  // Least squares of what agrees, which has a covariance.
  PoseEquations equations;
  for (int i = 0; i <= options_.refine_count; ++i) {
    equations = EquationsAt(sightings, pose.from_T_to, /*is_robust=*/false);
    if (i == options_.refine_count) break;
    const Vector6d step = equations.matrix.ldlt().solve(equations.right_side);
    if (!step.allFinite()) return std::nullopt;
    pose.from_T_to = MovedOnTheRight(pose.from_T_to, step);
  }
  const Eigen::LLT<Matrix6d> factor(equations.matrix);
  const int freedom = equations.row_count - static_cast<int>(Vector6d::RowsAtCompileTime);
  if (factor.info() != Eigen::Success || freedom <= 0) return std::nullopt;
  SightingPose result;
  result.from_T_to = pose.from_T_to;
  result.from_T_to.orientation.normalize();
  result.chi_square_mean = equations.chi_square / freedom;
  const Matrix6d covariance =
      std::max(1.0, result.chi_square_mean) * factor.solve(Matrix6d::Identity());
  result.covariance = 0.5 * (covariance + covariance.transpose());
  if (!result.covariance.allFinite()) return std::nullopt;
  const Pose3d to_T_from = result.from_T_to.Inverse();
  for (size_t i = 0; i < sightings.size(); ++i) {
    if (ChiSquareOf(sightings[i], result.from_T_to, to_T_from) <= options_.chi_square_max) {
      result.inliers.push_back(static_cast<int>(i));
    }
  }
  return result;
}

}  // namespace dsg::ingest
