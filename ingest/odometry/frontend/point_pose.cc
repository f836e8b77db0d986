// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/point_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "ingest/odometry/frontend/consensus.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using PoseStep = Eigen::Matrix<double, 6, 1>;
using PoseMatrix = Eigen::Matrix<double, 6, 6>;

// Points nearer than this to the plane of the camera have no projection, metres. A condition of the
// arithmetic, no option.
constexpr double kAheadMinM = 0.05;
constexpr int kPointSample = 3;

struct SightSearch {
  const CameraCalibration& camera;
  const RelativePoseOptions& options;
  std::vector<PointSight> sights;
  // Where each was among those given.
  std::vector<int> given;
};

struct SightMiss {
  bool is_ahead = false;
  // What is seen minus where it should be, pixels.
  Eigen::Vector2d miss = Eigen::Vector2d::Zero();
  Eigen::Vector3d point_camera = Eigen::Vector3d::Zero();

  double Square() const {
    return is_ahead ? miss.squaredNorm() : std::numeric_limits<double>::infinity();
  }
};

SightMiss MissAt(const SightSearch& search, const Pose3d& camera_T_map, const PointSight& sight) {
  SightMiss result;
  result.point_camera = camera_T_map * sight.point_map;
  const double depth_m = result.point_camera.z();
  if (!(depth_m > kAheadMinM)) return result;
  result.is_ahead = true;
  const CameraCalibration& camera = search.camera;
  result.miss.x() = sight.pixel.x() - camera.fx * result.point_camera.x() / depth_m - camera.cx;
  result.miss.y() = sight.pixel.y() - camera.fy * result.point_camera.y() / depth_m - camera.cy;
  return result;
}

double GateOf(const SightSearch& search) {
  return search.options.inlier_px * search.options.inlier_px;
}

struct ScoredPlace {
  Pose3d map_T_camera;
  double cost = std::numeric_limits<double>::infinity();
  int agree_count = 0;
};

// With infinite cost if it costs more than `limit`.
ScoredPlace ScoredAt(const SightSearch& search, const Pose3d& map_T_camera, double limit) {
  const Pose3d camera_T_map = map_T_camera.Inverse();
  const double gate = GateOf(search);
  ScoredPlace scored{map_T_camera, 0.0, 0};
  for (const PointSight& sight : search.sights) {
    const double square = MissAt(search, camera_T_map, sight).Square();
    scored.cost += std::isfinite(square) ? square / (square + gate) : 1.0;
    if (scored.cost > limit) return {};
    if (square <= gate) ++scored.agree_count;
  }
  return scored;
}

struct PlaceEquations {
  PoseMatrix matrix = PoseMatrix::Zero();
  PoseStep right_side = PoseStep::Zero();
  double square_sum = 0.0;
  int count = 0;
};

// Of all sights, weighted as their cost is, or of those that agree, as they are.
PlaceEquations EquationsAt(const SightSearch& search, const Pose3d& map_T_camera, bool is_robust) {
  const Pose3d camera_T_map = map_T_camera.Inverse();
  const Eigen::Matrix3d camera_R_map = camera_T_map.orientation.toRotationMatrix();
  const double gate = GateOf(search);
  PlaceEquations equations;
  for (const PointSight& sight : search.sights) {
    const SightMiss miss = MissAt(search, camera_T_map, sight);
    const double square = miss.Square();
    if (!miss.is_ahead || (!is_robust && square > gate)) continue;
    const Eigen::Vector3d& point = miss.point_camera;
    const double inverse = 1.0 / point.z();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << search.camera.fx * inverse, 0.0,
        -search.camera.fx * point.x() * inverse * inverse,  //
        0.0, search.camera.fy * inverse, -search.camera.fy * point.y() * inverse * inverse;
    Eigen::Matrix<double, 3, 6> point_by_step;
    point_by_step << -camera_R_map, CrossMatrix(point);
    const Eigen::Matrix<double, 2, 6> gradient = by_point * point_by_step;
    const double share = is_robust ? gate / (square + gate) : 1.0;
    equations.matrix += share * share * gradient.transpose() * gradient;
    equations.right_side += share * share * gradient.transpose() * miss.miss;
    equations.square_sum += square;
    ++equations.count;
  }
  return equations;
}

Pose3d SteppedPlace(const Pose3d& pose, const PoseStep& step) {
  return {pose.position + step.head<3>(),
          (pose.orientation * RotationOf(step.tail<3>())).normalized()};
}

ScoredPlace ImprovedPlace(const SightSearch& search, ScoredPlace place) {
  for (int i = 0; i < search.options.refine_count; ++i) {
    const PlaceEquations equations = EquationsAt(search, place.map_T_camera, /*is_robust=*/true);
    const PoseStep step = equations.matrix.ldlt().solve(equations.right_side);
    if (!step.allFinite()) break;
    const ScoredPlace next = ScoredAt(search, SteppedPlace(place.map_T_camera, step), place.cost);
    if (!(next.cost < place.cost)) break;
    place = next;
  }
  return place;
}

std::vector<Pose3d> PlacesOfThree(const SightSearch& search, std::span<const int> three) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> on_plane;
  for (const int i : three) {
    const PointSight& sight = search.sights[static_cast<size_t>(i)];
    points.emplace_back(sight.point_map.x(), sight.point_map.y(), sight.point_map.z());
    on_plane.emplace_back((sight.pixel.x() - search.camera.cx) / search.camera.fx,
                          (sight.pixel.y() - search.camera.cy) / search.camera.fy);
  }
  std::vector<cv::Vec3d> turns;
  std::vector<cv::Vec3d> shifts;
  cv::solveP3P(points, on_plane, cv::Matx33d::eye(), cv::noArray(), turns, shifts,
               cv::SOLVEPNP_AP3P);
  std::vector<Pose3d> places;
  for (size_t i = 0; i < turns.size(); ++i) {
    const Pose3d camera_T_map{{shifts[i][0], shifts[i][1], shifts[i][2]},
                              RotationOf({turns[i][0], turns[i][1], turns[i][2]})};
    const bool is_finite =
        camera_T_map.position.allFinite() && camera_T_map.orientation.coeffs().allFinite();
    if (is_finite) places.push_back(camera_T_map.Inverse());
  }
  return places;
}

ScoredPlace BestPlace(const SightSearch& search, const Pose3d& guess, int* draw_count) {
  ScoredPlace best =
      ImprovedPlace(search, ScoredAt(search, guess, std::numeric_limits<double>::infinity()));
  SampleDraws draws(static_cast<int>(search.sights.size()), kPointSample, search.options.consensus);
  draws.NoteAgreement(best.agree_count);
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    for (const Pose3d& place : PlacesOfThree(search, sample)) {
      const ScoredPlace scored = ScoredAt(search, place, best.cost);
      if (!(scored.cost < best.cost)) continue;
      best = ImprovedPlace(search, scored);
      draws.NoteAgreement(best.agree_count);
    }
  }
  *draw_count = draws.drawn_count();
  return best;
}

}  // namespace

PointPose PoseOfPoints(std::span<const PointSight> sights, const CameraCalibration& camera,
                       const Pose3d& guess, const RelativePoseOptions& options) {
  SightSearch search{camera, options, {}, {}};
  for (size_t i = 0; i < sights.size(); ++i) {
    if (!sights[i].point_map.allFinite() || !sights[i].pixel.allFinite()) continue;
    search.sights.push_back(sights[i]);
    search.given.push_back(static_cast<int>(i));
  }
  PointPose result;
  const int count = static_cast<int>(search.sights.size());
  if (count < kPointSample) return result;
  result.outcome = PoseOutcome::kNoConsensus;
  ScoredPlace place = BestPlace(search, guess, &result.draw_count);
  if (!IsConsensus(place.agree_count, count, options.consensus)) return result;
  // Least squares of what agrees, which has a covariance.
  PlaceEquations equations;
  for (int i = 0; i <= options.refine_count; ++i) {
    equations = EquationsAt(search, place.map_T_camera, /*is_robust=*/false);
    if (i == options.refine_count) break;
    const PoseStep step = equations.matrix.ldlt().solve(equations.right_side);
    if (!step.allFinite()) return result;
    place.map_T_camera = SteppedPlace(place.map_T_camera, step);
  }
  const int freedom = 2 * equations.count - static_cast<int>(PoseStep::RowsAtCompileTime);
  const Eigen::LLT<PoseMatrix> root(equations.matrix);
  // Points in line leave a turn open.
  if (freedom <= 0 || root.info() != Eigen::Success) return result;
  const double variance =
      std::max(options.pixel_sigma_px * options.pixel_sigma_px, equations.square_sum / freedom);
  const PoseMatrix covariance = variance * root.solve(PoseMatrix::Identity());
  if (!covariance.allFinite()) return result;
  result.outcome = PoseOutcome::kFound;
  result.map_T_camera = place.map_T_camera;
  result.covariance = 0.5 * (covariance + covariance.transpose());
  const Pose3d camera_T_map = place.map_T_camera.Inverse();
  for (size_t i = 0; i < search.sights.size(); ++i) {
    if (MissAt(search, camera_T_map, search.sights[i]).Square() <= GateOf(search)) {
      result.inliers.push_back(search.given[i]);
    }
  }
  return result;
}

}  // namespace dsg::ingest
