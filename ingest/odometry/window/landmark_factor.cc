// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/landmark_factor.h"

#include <ceres/sized_cost_function.h>

#include <cmath>

#include "ingest/sensor/pinhole.h"
#include "ingest/solver/pose_block.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Of the share of the way to the landmark that is along the optical axis; nearer to the plane of
// the camera a pixel says nothing.
constexpr double kAheadMin = 1e-3;

// A landmark in the frame of another image, times its inverse depth, so that infinitely far ones
// are a direction; and how that changes.
struct SeenRay {
  Vector3d ray_camera;
  // In the frames of the anchor's unit and of the other one, times the inverse depth.
  Vector3d ray_anchor;
  Vector3d ray_imu;
  Matrix3d imu_R_map;
  Matrix3d map_R_anchor;
};

SeenRay RayFrom(const StereoModel& model, const Pose3d& map_T_anchor, const Pose3d& map_T_imu,
                const double* landmark) {
  const Pose3d& mount = model.imu_T_camera;
  const Vector3d anchor_ray(landmark[0], landmark[1], 1.0);
  const double inverse_depth = landmark[2];
  SeenRay seen;
  seen.imu_R_map = map_T_imu.orientation.conjugate().toRotationMatrix();
  seen.map_R_anchor = map_T_anchor.orientation.toRotationMatrix();
  seen.ray_anchor = mount.orientation * anchor_ray + inverse_depth * mount.position;
  seen.ray_imu = seen.imu_R_map * (seen.map_R_anchor * seen.ray_anchor +
                                   inverse_depth * (map_T_anchor.position - map_T_imu.position));
  seen.ray_camera = mount.orientation.conjugate() * (seen.ray_imu - inverse_depth * mount.position);
  return seen;
}

bool IsAhead(const Vector3d& ray_camera) { return ray_camera.z() > kAheadMin * ray_camera.norm(); }

// Rows of a sight, as weighed.
template <int kRows>
struct WeighedSight {
  using Rows = Eigen::Matrix<double, kRows, 1>;

  WeighedSight(const LandmarkSight& sight, const SightNoise& noise) {
    measured.template head<2>() = sight.pixel;
    weights.template head<2>().setConstant(1.0 / noise.pixel_px);
    if constexpr (kRows == 3) {
      measured.z() = *sight.disparity_px;
      weights.z() = 1.0 / noise.disparity_px;
    }
  }

  Rows measured;
  Rows weights;
};

template <int kRows>
class SightFactor
    : public ceres::SizedCostFunction<kRows, kPoseBlockSize, kPoseBlockSize, kLandmarkBlockSize> {
 public:
  SightFactor(const StereoModel& model, const LandmarkSight& sight, const SightNoise& noise)
      : model_(model), sight_(sight, noise) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Pose3d map_T_anchor = PoseOfBlock(blocks[0]);
    const Pose3d map_T_imu = PoseOfBlock(blocks[1]);
    const double inverse_depth = blocks[2][2];
    const SeenRay seen = RayFrom(model_, map_T_anchor, map_T_imu, blocks[2]);
    const Vector3d& ray = seen.ray_camera;
    if (!IsAhead(ray)) return false;
    const double per_z = 1.0 / ray.z();
    const double stereo = model_.fx * model_.baseline_m;
    Rows predicted;
    predicted.template head<2>() << model_.cx + model_.fx * ray.x() * per_z,
        model_.cy + model_.fy * ray.y() * per_z;
    if constexpr (kRows == 3) predicted.z() = stereo * inverse_depth * per_z;
    Eigen::Map<Rows>{residuals} = sight_.weights.cwiseProduct(predicted - sight_.measured);
    if (jacobians == nullptr) return true;

    Eigen::Matrix<double, kRows, 3> by_ray = Eigen::Matrix<double, kRows, 3>::Zero();
    by_ray(0, 0) = model_.fx * per_z;
    by_ray(0, 2) = -model_.fx * ray.x() * per_z * per_z;
    by_ray(1, 1) = model_.fy * per_z;
    by_ray(1, 2) = -model_.fy * ray.y() * per_z * per_z;
    if constexpr (kRows == 3) by_ray(2, 2) = -stereo * inverse_depth * per_z * per_z;
    by_ray = sight_.weights.asDiagonal() * Eigen::Matrix<double, kRows, 3>(by_ray);
    WriteJacobians(seen, map_T_anchor, map_T_imu, inverse_depth, by_ray, jacobians);
    if (jacobians[2] != nullptr && kRows == 3) {
      jacobians[2][kRows * kLandmarkBlockSize - 1] += sight_.weights[kRows - 1] * stereo * per_z;
    }
    return true;
  }

 private:
  using Rows = Eigen::Matrix<double, kRows, 1>;
  using PoseJacobian = Eigen::Matrix<double, kRows, kPoseBlockSize, Eigen::RowMajor>;
  using LandmarkJacobian = Eigen::Matrix<double, kRows, kLandmarkBlockSize, Eigen::RowMajor>;

  void WriteJacobians(const SeenRay& seen, const Pose3d& map_T_anchor, const Pose3d& map_T_imu,
                      double inverse_depth, const Eigen::Matrix<double, kRows, 3>& by_ray,
                      double** jacobians) const {
    const Pose3d& mount = model_.imu_T_camera;
    const Matrix3d mount_turn = mount.orientation.toRotationMatrix();
    const Eigen::Matrix<double, kRows, 3> by_imu_ray = by_ray * mount_turn.transpose();
    const Eigen::Matrix<double, kRows, 3> by_map_ray = by_imu_ray * seen.imu_R_map;
    if (jacobians[0] != nullptr) {
      Eigen::Map<PoseJacobian> jacobian(jacobians[0]);
      jacobian << inverse_depth * by_map_ray,
          -by_map_ray * seen.map_R_anchor * CrossMatrix(seen.ray_anchor), Rows::Zero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<PoseJacobian> jacobian(jacobians[1]);
      jacobian << -inverse_depth * by_map_ray, by_imu_ray * CrossMatrix(seen.ray_imu), Rows::Zero();
    }
    if (jacobians[2] != nullptr) {
      const Vector3d imu_ray = seen.imu_R_map * (seen.map_R_anchor * mount.position +
                                                 map_T_anchor.position - map_T_imu.position) -
                               mount.position;
      Eigen::Map<LandmarkJacobian> jacobian(jacobians[2]);
      jacobian << by_map_ray * seen.map_R_anchor * mount_turn.leftCols<2>(), by_imu_ray * imu_ray;
    }
  }

  const StereoModel model_;
  const WeighedSight<kRows> sight_;
};

template <int kRows>
class AnchorFactor : public ceres::SizedCostFunction<kRows, kLandmarkBlockSize> {
 public:
  AnchorFactor(const StereoModel& model, const LandmarkSight& sight, const SightNoise& noise)
      : model_(model), sight_(sight, noise) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Vector3d predicted(model_.cx + model_.fx * blocks[0][0],
                             model_.cy + model_.fy * blocks[0][1],
                             model_.DisparityOf(blocks[0][2]));
    Eigen::Map<Rows>{residuals} =
        sight_.weights.cwiseProduct(predicted.head<kRows>() - sight_.measured);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    const Vector3d slopes(model_.fx, model_.fy, model_.DisparityOf(1.0));
    Eigen::Map<Eigen::Matrix<double, kRows, kLandmarkBlockSize, Eigen::RowMajor>> jacobian(
        jacobians[0]);
    jacobian.setZero();
    for (int i = 0; i < kRows; ++i) jacobian(i, i) = sight_.weights[i] * slopes[i];
    return true;
  }

 private:
  using Rows = Eigen::Matrix<double, kRows, 1>;

  const StereoModel model_;
  const WeighedSight<kRows> sight_;
};

}  // namespace

StereoModel StereoModel::Make(const CameraCalibration& left, double baseline_m,
                              const Pose3d& body_T_imu) {
  return {left.fx,
          left.fy,
          left.cx,
          left.cy,
          std::abs(baseline_m),
          body_T_imu.Inverse() * left.body_T_camera};
}

Vector3d StereoModel::RayOf(const Vector2d& pixel) const {
  return {(pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1.0};
}

std::unique_ptr<ceres::CostFunction> MakeSightFactor(const StereoModel& model,
                                                     const LandmarkSight& sight,
                                                     const SightNoise& noise) {
  if (sight.disparity_px.has_value()) {
    return std::make_unique<SightFactor<3>>(model, sight, noise);
  }
  return std::make_unique<SightFactor<2>>(model, sight, noise);
}

std::unique_ptr<ceres::CostFunction> MakeAnchorFactor(const StereoModel& model,
                                                      const LandmarkSight& sight,
                                                      const SightNoise& noise) {
  if (sight.disparity_px.has_value()) {
    return std::make_unique<AnchorFactor<3>>(model, sight, noise);
  }
  return std::make_unique<AnchorFactor<2>>(model, sight, noise);
}

std::optional<Vector3d> SightErrorOf(const StereoModel& model, const Pose3d& map_T_anchor,
                                     const Pose3d& map_T_imu, const LandmarkSight& sight,
                                     const LandmarkBlock& landmark) {
  const Vector3d ray = RayFrom(model, map_T_anchor, map_T_imu, landmark.data()).ray_camera;
  if (!IsAhead(ray)) return std::nullopt;
  const double disparity_px = model.DisparityOf(landmark[2]) / ray.z();
  return Vector3d(model.cx + model.fx * ray.x() / ray.z() - sight.pixel.x(),
                  model.cy + model.fy * ray.y() / ray.z() - sight.pixel.y(),
                  disparity_px - sight.disparity_px.value_or(disparity_px));
}

}  // namespace dsg::ingest
