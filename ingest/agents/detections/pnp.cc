// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/pnp.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace dsg::ingest {
namespace {

// Weights have settled by then.
constexpr int kReweightCount = 3;
// Nearer joints have no sensible pixel.
constexpr double kJointDepthMinM = 0.05;
constexpr double kConditionMin = 1e-9;
// Six unknowns take three joints; twice as many say whether they fit.
constexpr int kSixDofJointsMin = 6;

double ErrorPx(const SeenJoint& joint, double focal_px, const Eigen::Vector3d& at) {
  if (at.z() < kJointDepthMinM) return std::numeric_limits<double>::infinity();
  return focal_px * (at.head<2>() / at.z() - joint.ray).norm();
}

struct NormalEquations {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};

// tx - x tz = x Z - X and the same for y, scaled to pixels at `depth_m`.
void Add(const SeenJoint& joint, double weight, double px_per_m, NormalEquations* equations) {
  Eigen::Matrix<double, 2, 3> rows;
  rows << 1.0, 0.0, -joint.ray.x(), 0.0, 1.0, -joint.ray.y();
  const Eigen::Vector2d right = joint.ray * joint.root.z() - joint.root.head<2>();
  const double scale = weight * px_per_m * px_per_m;
  equations->a += scale * rows.transpose() * rows;
  equations->b += scale * rows.transpose() * right;
}

}  // namespace

double ReprojectionPx(const std::vector<SeenJoint>& joints, double focal_px,
                      const Eigen::Vector3d& root_camera, const Eigen::Quaterniond& turn) {
  double sum = 0.0;
  double weight = 0.0;
  for (const SeenJoint& joint : joints) {
    const double error_px = ErrorPx(joint, focal_px, root_camera + turn * joint.root);
    sum += joint.weight * error_px * error_px;
    weight += joint.weight;
  }
  return weight > 0.0 ? std::sqrt(sum / weight) : 0.0;
}

std::optional<BodyPlacement> PlaceByTranslation(const std::vector<SeenJoint>& joints,
                                                double focal_px, const PlacementOptions& options) {
  if (std::ssize(joints) < kPnpJointsMin) return std::nullopt;
  BodyPlacement placement;
  NormalEquations equations;
  for (int round = 0; round <= kReweightCount; ++round) {
    equations = NormalEquations();
    for (const SeenJoint& joint : joints) {
      double weight = joint.weight;
      double px_per_m = focal_px;
      if (round > 0) {
        const Eigen::Vector3d at = placement.root_camera + joint.root;
        const double error_px = ErrorPx(joint, focal_px, at);
        weight *= error_px > options.huber_px ? options.huber_px / error_px : 1.0;
        px_per_m /= std::max(at.z(), kJointDepthMinM);
      }
      Add(joint, weight, px_per_m, &equations);
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(equations.a);
    const double scale = equations.a.trace();
    const bool is_solvable = scale > 0.0 && solver.info() == Eigen::Success &&
                             solver.vectorD().minCoeff() > kConditionMin * scale;
    if (!is_solvable) return std::nullopt;
    placement.root_camera = solver.solve(equations.b);
    placement.covariance = solver.solve(Eigen::Matrix3d::Identity());
    if (!placement.root_camera.allFinite()) return std::nullopt;
    // Behind the camera no joint has a pixel to be wrong about; the caller refuses it.
    if (placement.root_camera.z() < kJointDepthMinM) return placement;
  }
  placement.reprojection_px =
      ReprojectionPx(joints, focal_px, placement.root_camera, placement.turn);
  const double noise_px = std::max(placement.reprojection_px, options.noise_px_min);
  placement.covariance *= noise_px * noise_px;
  return placement;
}

std::optional<BodyPlacement> RefineSixDof(const std::vector<SeenJoint>& joints, double focal_px,
                                          const BodyPlacement& start, double turn_rad_max) {
  if (std::ssize(joints) < kSixDofJointsMin || start.root_camera.z() < kJointDepthMinM) {
    return std::nullopt;
  }
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const SeenJoint& joint : joints) {
    points.emplace_back(joint.root.x(), joint.root.y(), joint.root.z());
    pixels.emplace_back(focal_px * joint.ray.x(), focal_px * joint.ray.y());
  }
  const cv::Matx33d camera(focal_px, 0, 0, 0, focal_px, 0, 0, 0, 1);
  cv::Mat rotation = cv::Mat::zeros(3, 1, CV_64F);
  cv::Mat translation = (cv::Mat_<double>(3, 1) << start.root_camera.x(), start.root_camera.y(),
                         start.root_camera.z());
  try {
    cv::solvePnPRefineLM(points, pixels, camera, cv::noArray(), rotation, translation);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  BodyPlacement refined = start;
  refined.root_camera = {translation.at<double>(0), translation.at<double>(1),
                         translation.at<double>(2)};
  const Eigen::Vector3d turn(rotation.at<double>(0), rotation.at<double>(1),
                             rotation.at<double>(2));
  const double angle = turn.norm();
  if (!refined.root_camera.allFinite() || !(angle < turn_rad_max)) return std::nullopt;
  if (angle > 0.0) refined.turn = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
  refined.reprojection_px = ReprojectionPx(joints, focal_px, refined.root_camera, refined.turn);
  if (!(refined.reprojection_px < start.reprojection_px)) return std::nullopt;
  return refined;
}

}  // namespace dsg::ingest
