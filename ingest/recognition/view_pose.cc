// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <tuple>
#include <utility>

#include "ingest/odometry/frontend/consensus.h"
#include "ingest/recognition/view_pose_internal.h"
#include "ingest/sensor/pinhole.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Twist = Eigen::Matrix<double, 6, 1>;
using TwistMatrix = Eigen::Matrix<double, 6, 6>;

// Points nearer than this to the plane of a camera have no projection, metres. A condition of the
// arithmetic, no option.
constexpr double kDepthMinM = 0.05;
constexpr int kSampleOfThree = 3;

Pose3d MovedOnTheRight(const Pose3d& pose, const Twist& twist) {
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
struct ViewPoseSearch::SightingError {
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

struct ViewPoseSearch::ScoredPose {
  Pose3d from_T_to;
  double cost = std::numeric_limits<double>::infinity();
  int agree_count = 0;
};

struct ViewPoseSearch::PoseEquations {
  TwistMatrix matrix = TwistMatrix::Zero();
  Twist right_side = Twist::Zero();
  double chi_square = 0.0;
  int row_count = 0;
};

PointSighting ViewPoseSearch::SightingOf(const FeatureMatch& match, bool is_forward) const {
  const KeyframeFeatures& knows = is_forward ? from_ : to_;
  const KeyframeFeatures& sees = is_forward ? to_ : from_;
  const KeyframeFeature& known =
      knows.features[static_cast<size_t>(is_forward ? match.from : match.to)];
  const KeyframeFeature& seen =
      sees.features[static_cast<size_t>(is_forward ? match.to : match.from)];
  const Eigen::Vector3d ray = PinholeRay(knows.camera, known.pixel.x(), known.pixel.y());
  PointSighting sighting;
  sighting.match = match;
  sighting.is_forward = is_forward;
  sighting.point = double{known.depth_m} * ray;
  sighting.depth_step = double{known.depth_sigma_m} * ray;
  sighting.aside_sigma_m = double{known.depth_m} * known.pixel_sigma_px / knows.camera.fx;
  sighting.pixel = seen.pixel.cast<double>();
  sighting.pixel_sigma_px = seen.pixel_sigma_px;
  if (seen.depth_m > 0.0f && seen.depth_sigma_m > 0.0f) {
    sighting.inverse_depth = 1.0 / seen.depth_m;
    sighting.inverse_sigma = seen.depth_sigma_m / (double{seen.depth_m} * seen.depth_m);
  }
  return sighting;
}

std::vector<PointSighting> ViewPoseSearch::SightingsOf(
    const std::vector<FeatureMatch>& matches) const {
  std::vector<PointSighting> sightings;
  for (const FeatureMatch& match : matches) {
    const bool from_knows = from_.features[static_cast<size_t>(match.from)].depth_m > 0.0f;
    const bool to_knows = to_.features[static_cast<size_t>(match.to)].depth_m > 0.0f;
    if (from_knows || to_knows) sightings.push_back(SightingOf(match, from_knows));
  }
  return sightings;
}

ViewPoseSearch::SightingError ViewPoseSearch::ErrorOf(const PointSighting& sighting,
                                                      const Pose3d& from_T_to,
                                                      const Pose3d& to_T_from) const {
  const Pose3d& sees_T_knows = sighting.is_forward ? to_T_from : from_T_to;
  const CameraCalibration& camera = sighting.is_forward ? to_.camera : from_.camera;
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

ViewPoseSearch::ScoredPose ViewPoseSearch::ScoreOf(const std::vector<PointSighting>& sightings,
                                                   const Pose3d& from_T_to, double limit) const {
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

ViewPoseSearch::PoseEquations ViewPoseSearch::EquationsAt(
    const std::vector<PointSighting>& sightings, const Pose3d& from_T_to, bool is_robust) const {
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

ViewPoseSearch::ScoredPose ViewPoseSearch::Improved(const std::vector<PointSighting>& sightings,
                                                    ScoredPose pose) const {
  for (int i = 0; i < options_.refine_count; ++i) {
    const PoseEquations equations = EquationsAt(sightings, pose.from_T_to, /*is_robust=*/true);
    const Twist step = equations.matrix.ldlt().solve(equations.right_side);
    if (!step.allFinite()) break;
    const ScoredPose next = ScoreOf(sightings, MovedOnTheRight(pose.from_T_to, step), pose.cost);
    if (!(next.cost < pose.cost)) break;
    pose = next;
  }
  return pose;
}

std::vector<Pose3d> ViewPoseSearch::PosesOfThree(const std::vector<PointSighting>& sightings,
                                                 const std::vector<size_t>& three) const {
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
  cv::solveP3P(points, OnUnitPlane(is_forward ? to_.camera : from_.camera, pixels),
               cv::Matx33d::eye(), cv::noArray(), turns, shifts, cv::SOLVEPNP_AP3P);
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

std::optional<Pose3d> ViewPoseSearch::Consensus(const std::vector<PointSighting>& sightings,
                                                int* draw_count) const {
  // Samples are of one kind, the one that there is more of.
  std::vector<size_t> forward;
  std::vector<size_t> backward;
  for (size_t i = 0; i < sightings.size(); ++i) {
    (sightings[i].is_forward ? forward : backward).push_back(i);
  }
  const std::vector<size_t>& kind = forward.size() >= backward.size() ? forward : backward;
  if (std::ssize(kind) < kSampleOfThree) return std::nullopt;
  ScoredPose best;
  SampleDraws draws(static_cast<int>(kind.size()), kSampleOfThree, options_.consensus);
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    std::vector<size_t> three;
    for (const int i : sample) three.push_back(kind[static_cast<size_t>(i)]);
    for (const Pose3d& pose : PosesOfThree(sightings, three)) {
      const ScoredPose scored = ScoreOf(sightings, pose, best.cost);
      if (!(scored.cost < best.cost)) continue;
      best = Improved(sightings, scored);
      // Of the kind that is drawn at most as many are right as of all.
      draws.NoteAgreement(std::min(best.agree_count, static_cast<int>(kind.size())));
    }
  }
  *draw_count = draws.drawn_count();
  if (!IsConsensus(best.agree_count, static_cast<int>(sightings.size()), options_.consensus)) {
    return std::nullopt;
  }
  return best.from_T_to;
}

int ViewPoseSearch::AgreeCount(const std::vector<PointSighting>& sightings,
                               const Pose3d& from_T_to) const {
  return ScoreOf(sightings, from_T_to, std::numeric_limits<double>::infinity()).agree_count;
}

std::vector<FeatureMatch> ViewPoseSearch::MatchesNear(const Pose3d& from_T_to) const {
  const Pose3d to_T_from = from_T_to.Inverse();
  // Bits, then both features: the most alike ones first.
  std::vector<std::tuple<int, int, int>> near;
  for (int i = 0; i < static_cast<int>(from_.features.size()); ++i) {
    const bool from_knows = from_.features[static_cast<size_t>(i)].depth_m > 0.0f;
    for (int k = 0; k < static_cast<int>(to_.features.size()); ++k) {
      const int bits = bits_(i, k);
      if (bits > options_.search_bits_max) continue;
      const bool to_knows = to_.features[static_cast<size_t>(k)].depth_m > 0.0f;
      if (!from_knows && !to_knows) continue;
      const PointSighting sighting = SightingOf({i, k}, from_knows);
      const SightingError error = ErrorOf(sighting, from_T_to, to_T_from);
      if (!error.is_before) continue;
      // What the first pose errs by comes on top of what the match does.
      const double reach =
          std::max(options_.search_sigmas, options_.search_px / sighting.pixel_sigma_px);
      if (error.ChiSquare() <= reach * reach) near.emplace_back(bits, i, k);
    }
  }
  std::sort(near.begin(), near.end());
  std::vector<uint8_t> is_from_taken(from_.features.size(), 0);
  std::vector<uint8_t> is_to_taken(to_.features.size(), 0);
  std::vector<FeatureMatch> matches;
  for (const auto& [bits, i, k] : near) {
    uint8_t& from_taken = is_from_taken[static_cast<size_t>(i)];
    uint8_t& to_taken = is_to_taken[static_cast<size_t>(k)];
    if (from_taken != 0 || to_taken != 0) continue;
    from_taken = to_taken = 1;
    matches.push_back({i, k});
  }
  std::sort(matches.begin(), matches.end(),
            [](const FeatureMatch& a, const FeatureMatch& b) { return a.from < b.from; });
  return matches;
}

std::optional<ViewPose> ViewPoseSearch::Refined(const std::vector<PointSighting>& sightings,
                                                const Pose3d& start) const {
  ScoredPose pose =
      Improved(sightings, ScoreOf(sightings, start, std::numeric_limits<double>::infinity()));
  // Least squares of what agrees, which has a covariance.
  PoseEquations equations;
  for (int i = 0; i <= options_.refine_count; ++i) {
    equations = EquationsAt(sightings, pose.from_T_to, /*is_robust=*/false);
    if (i == options_.refine_count) break;
    const Twist step = equations.matrix.ldlt().solve(equations.right_side);
    if (!step.allFinite()) return std::nullopt;
    pose.from_T_to = MovedOnTheRight(pose.from_T_to, step);
  }
  const Eigen::LLT<TwistMatrix> factor(equations.matrix);
  const int freedom = equations.row_count - static_cast<int>(Twist::RowsAtCompileTime);
  if (factor.info() != Eigen::Success || freedom <= 0) return std::nullopt;
  ViewPose result;
  result.from_T_to = pose.from_T_to;
  result.from_T_to.orientation.normalize();
  result.chi_square_mean = equations.chi_square / freedom;
  const TwistMatrix covariance =
      std::max(1.0, result.chi_square_mean) * factor.solve(TwistMatrix::Identity());
  result.covariance = 0.5 * (covariance + covariance.transpose());
  if (!result.covariance.allFinite()) return std::nullopt;
  const Pose3d to_T_from = result.from_T_to.Inverse();
  for (const PointSighting& sighting : sightings) {
    if (ErrorOf(sighting, result.from_T_to, to_T_from).ChiSquare() <= options_.chi_square_max) {
      result.inliers.push_back(sighting.match);
    }
  }
  return result;
}

}  // namespace dsg::ingest
