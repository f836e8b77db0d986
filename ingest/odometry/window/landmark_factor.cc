// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/landmark_factor.h"

#include <ceres/sized_cost_function.h>

#include <cmath>
#include <type_traits>

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

// Column, row and disparity of a ray (a point times its inverse depth), and how they change.
struct Prediction {
  Vector3d sight;
  Matrix3d by_ray;
  // Of the disparity alone.
  double by_inverse_depth;
  Eigen::RowVector2d by_stereo_error;
};

Prediction PredictionOf(const StereoModel& model, const Vector3d& ray, double inverse_depth,
                        const double* stereo_error) {
  const double per_z = 1.0 / ray.z();
  const double offset_px = stereo_error == nullptr ? 0.0 : stereo_error[0];
  const double baseline_m =
      model.baseline_m * (1.0 + (stereo_error == nullptr ? 0.0 : stereo_error[1]));
  const double disparity_px = model.fx * baseline_m * inverse_depth * per_z;
  Prediction predicted;
  predicted.sight << model.cx + model.fx * ray.x() * per_z, model.cy + model.fy * ray.y() * per_z,
      disparity_px + offset_px;
  predicted.by_ray << model.fx * per_z, 0.0, -model.fx * ray.x() * per_z * per_z,  //
      0.0, model.fy * per_z, -model.fy * ray.y() * per_z * per_z,                  //
      0.0, 0.0, -disparity_px * per_z;
  predicted.by_inverse_depth = model.fx * baseline_m * per_z;
  predicted.by_stereo_error << 1.0, model.fx * model.baseline_m * inverse_depth * per_z;
  return predicted;
}

// The derivatives by what moves a ray. `by_ray` are the weighed ones of the rows by the ray.
template <int kRows>
void WriteRayJacobians(const StereoModel& model, const SeenRay& seen, const Pose3d& map_T_anchor,
                       const Pose3d& map_T_imu, double inverse_depth,
                       const Eigen::Matrix<double, kRows, 3>& by_ray, double** jacobians) {
  using PoseJacobian = Eigen::Matrix<double, kRows, kPoseBlockSize, Eigen::RowMajor>;
  using LandmarkJacobian = Eigen::Matrix<double, kRows, kLandmarkBlockSize, Eigen::RowMajor>;
  const Pose3d& mount = model.imu_T_camera;
  const Matrix3d mount_turn = mount.orientation.toRotationMatrix();
  const Eigen::Matrix<double, kRows, 3> by_imu_ray = by_ray * mount_turn.transpose();
  const Eigen::Matrix<double, kRows, 3> by_map_ray = by_imu_ray * seen.imu_R_map;
  const Eigen::Matrix<double, kRows, 1> none = Eigen::Matrix<double, kRows, 1>::Zero();
  if (jacobians[0] != nullptr) {
    Eigen::Map<PoseJacobian> jacobian(jacobians[0]);
    jacobian << inverse_depth * by_map_ray,
        -by_map_ray * seen.map_R_anchor * CrossMatrix(seen.ray_anchor), none;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<PoseJacobian> jacobian(jacobians[1]);
    jacobian << -inverse_depth * by_map_ray, by_imu_ray * CrossMatrix(seen.ray_imu), none;
  }
  if (jacobians[2] != nullptr) {
    const Vector3d imu_ray = seen.imu_R_map * (seen.map_R_anchor * mount.position +
                                               map_T_anchor.position - map_T_imu.position) -
                             mount.position;
    Eigen::Map<LandmarkJacobian> jacobian(jacobians[2]);
    jacobian << by_map_ray * seen.map_R_anchor * mount_turn.leftCols<2>(), by_imu_ray * imu_ray;
  }
}

// Of a sight with a disparity, which alone depends on the stereo error.
void WriteStereoErrorJacobian(const Prediction& predicted, double weight, double* output) {
  if (output == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, 3, kStereoErrorSize, Eigen::RowMajor>> jacobian(output);
  jacobian.setZero();
  jacobian.row(2) = weight * predicted.by_stereo_error;
}

using MonoSightBase =
    ceres::SizedCostFunction<2, kPoseBlockSize, kPoseBlockSize, kLandmarkBlockSize>;
using StereoSightBase = ceres::SizedCostFunction<3, kPoseBlockSize, kPoseBlockSize,
                                                 kLandmarkBlockSize, kStereoErrorSize>;

// With kRows 3 the last row is the disparity, and the fourth block the stereo error.
template <int kRows>
class SightFactor : public std::conditional_t<kRows == 3, StereoSightBase, MonoSightBase> {
 public:
  SightFactor(const StereoModel& model, const LandmarkSight& sight, const SightNoise& noise)
      : model_(model), sight_(sight, noise) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Pose3d map_T_anchor = PoseOfBlock(blocks[0]);
    const Pose3d map_T_imu = PoseOfBlock(blocks[1]);
    const double inverse_depth = blocks[2][2];
    const SeenRay seen = RayFrom(model_, map_T_anchor, map_T_imu, blocks[2]);
    if (!IsAhead(seen.ray_camera)) return false;
    const Prediction predicted =
        PredictionOf(model_, seen.ray_camera, inverse_depth, kRows == 3 ? blocks[kRows] : nullptr);
    Eigen::Map<Rows>{residuals} =
        sight_.weights.cwiseProduct(predicted.sight.template head<kRows>() - sight_.measured);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, kRows, 3> by_ray =
        sight_.weights.asDiagonal() * predicted.by_ray.template topRows<kRows>();
    WriteRayJacobians<kRows>(model_, seen, map_T_anchor, map_T_imu, inverse_depth, by_ray,
                             jacobians);
    if constexpr (kRows == 3) {
      if (jacobians[2] != nullptr) {
        jacobians[2][8] += sight_.weights[2] * predicted.by_inverse_depth;
      }
      WriteStereoErrorJacobian(predicted, sight_.weights[2], jacobians[3]);
    }
    return true;
  }

 private:
  using Rows = Eigen::Matrix<double, kRows, 1>;

  const StereoModel model_;
  const WeighedSight<kRows> sight_;
};

using MonoAnchorBase = ceres::SizedCostFunction<2, kLandmarkBlockSize>;
using StereoAnchorBase = ceres::SizedCostFunction<3, kLandmarkBlockSize, kStereoErrorSize>;

template <int kRows>
class AnchorFactor : public std::conditional_t<kRows == 3, StereoAnchorBase, MonoAnchorBase> {
 public:
  AnchorFactor(const StereoModel& model, const LandmarkSight& sight, const SightNoise& noise)
      : model_(model), sight_(sight, noise) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Vector3d ray(blocks[0][0], blocks[0][1], 1.0);
    const Prediction predicted =
        PredictionOf(model_, ray, blocks[0][2], kRows == 3 ? blocks[1] : nullptr);
    Eigen::Map<Rows>{residuals} =
        sight_.weights.cwiseProduct(predicted.sight.template head<kRows>() - sight_.measured);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, kLandmarkBlockSize, Eigen::RowMajor>> jacobian(
          jacobians[0]);
      jacobian.setZero();
      jacobian(0, 0) = sight_.weights[0] * model_.fx;
      jacobian(1, 1) = sight_.weights[1] * model_.fy;
      if constexpr (kRows == 3) jacobian(2, 2) = sight_.weights[2] * predicted.by_inverse_depth;
    }
    if constexpr (kRows == 3) {
      WriteStereoErrorJacobian(predicted, sight_.weights[2], jacobians[1]);
    }
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

double DisparityOf(const StereoModel& model, const StereoError& error, double inverse_depth) {
  return model.fx * model.baseline_m * (1.0 + error[1]) * inverse_depth + error[0];
}

double InverseDepthOf(const StereoModel& model, const StereoError& error, double disparity_px) {
  return (disparity_px - error[0]) / (model.fx * model.baseline_m * (1.0 + error[1]));
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
                                     const LandmarkBlock& landmark, const StereoError& error) {
  const Vector3d ray = RayFrom(model, map_T_anchor, map_T_imu, landmark.data()).ray_camera;
  if (!IsAhead(ray)) return std::nullopt;
  const Vector3d predicted = PredictionOf(model, ray, landmark[2], error.data()).sight;
  return Vector3d(predicted.x() - sight.pixel.x(), predicted.y() - sight.pixel.y(),
                  predicted.z() - sight.disparity_px.value_or(predicted.z()));
}

}  // namespace dsg::ingest
