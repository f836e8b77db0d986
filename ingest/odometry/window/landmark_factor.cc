// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/landmark_factor.h"

#include <ceres/sized_cost_function.h>

#include <cmath>

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

  void WriteMiss(const Vector3d& predicted, double* residuals) const {
    Eigen::Map<Rows>{residuals} = weights.cwiseProduct(predicted.template head<kRows>() - measured);
  }
  // The rows that the sight has.
  template <int kColumns>
  Eigen::Matrix<double, kRows, kColumns> Weighed(
      const Eigen::Matrix<double, 3, kColumns>& derivatives) const {
    return weights.asDiagonal() * derivatives.template topRows<kRows>();
  }

  Rows measured;
  Rows weights;
};

// Column, row and disparity of a ray (a point times its inverse depth) of the instant of the stamp,
// and how they change.
struct Prediction {
  Vector3d sight;
  Matrix3d by_ray;
  // With the ray as it is.
  Vector3d by_inverse_depth;
  Eigen::Matrix<double, 3, kCalibrationErrorSize> by_error;
};

// How a point at rest, times its inverse depth, moves in the frame of a camera that moves.
Vector3d RateOf(const CameraMotion& motion, const Vector3d& ray, double inverse_depth) {
  return ray.cross(motion.turn_rad_s) - inverse_depth * motion.speed_m_s;
}

// Nullopt unless the point is before the camera when the image is taken.
std::optional<Prediction> PredictionOf(const StereoModel& model, const CameraMotion& motion,
                                       const Vector3d& stamp_ray, double inverse_depth,
                                       const double* error) {
  const double late_s = error[2];
  const Vector3d rate = RateOf(motion, stamp_ray, inverse_depth);
  const Vector3d ray = stamp_ray + late_s * rate;
  if (!IsAhead(ray)) return std::nullopt;
  const double per_z = 1.0 / ray.z();
  const double per_baseline_px = model.fx * inverse_depth * per_z;
  const double baseline_m = model.baseline_m * (1.0 + error[1]);
  const double disparity_px = per_baseline_px * baseline_m;
  Prediction predicted;
  predicted.sight << model.cx + model.fx * ray.x() * per_z, model.cy + model.fy * ray.y() * per_z,
      disparity_px + error[0];
  Matrix3d by_late_ray;
  by_late_ray << model.fx * per_z, 0.0, -model.fx * ray.x() * per_z * per_z,  //
      0.0, model.fy * per_z, -model.fy * ray.y() * per_z * per_z,             //
      0.0, 0.0, -disparity_px * per_z;
  predicted.by_ray = by_late_ray * (Matrix3d::Identity() - late_s * CrossMatrix(motion.turn_rad_s));
  predicted.by_inverse_depth = -late_s * (by_late_ray * motion.speed_m_s);
  predicted.by_inverse_depth.z() += model.fx * baseline_m * per_z;
  predicted.by_error << Vector3d::UnitZ(), per_baseline_px * model.baseline_m * Vector3d::UnitZ(),
      by_late_ray * rate;
  return predicted;
}

// The derivatives by both poses and the landmark.
template <int kRows>
void WriteRayJacobians(const StereoModel& model, const SeenRay& seen, const Pose3d& map_T_anchor,
                       const Pose3d& map_T_imu, double inverse_depth, const Prediction& predicted,
                       const WeighedSight<kRows>& sight, double** jacobians) {
  using PoseJacobian = Eigen::Matrix<double, kRows, kPoseBlockSize, Eigen::RowMajor>;
  using LandmarkJacobian = Eigen::Matrix<double, kRows, kLandmarkBlockSize, Eigen::RowMajor>;
  const Pose3d& mount = model.imu_T_camera;
  const Matrix3d mount_turn = mount.orientation.toRotationMatrix();
  const Eigen::Matrix<double, kRows, 3> by_imu_ray =
      sight.Weighed(predicted.by_ray) * mount_turn.transpose();
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
    jacobian << by_map_ray * seen.map_R_anchor * mount_turn.leftCols<2>(),
        by_imu_ray * imu_ray + sight.Weighed(predicted.by_inverse_depth);
  }
}

template <int kRows>
void WriteErrorJacobian(const Prediction& predicted, const WeighedSight<kRows>& sight,
                        double* output) {
  if (output == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, kRows, kCalibrationErrorSize, Eigen::RowMajor>>{output} =
      sight.Weighed(predicted.by_error);
}

// With kRows 3 the last row is the disparity.
template <int kRows>
class SightFactor : public ceres::SizedCostFunction<kRows, kPoseBlockSize, kPoseBlockSize,
                                                    kLandmarkBlockSize, kCalibrationErrorSize> {
 public:
  SightFactor(const StereoModel& model, const LandmarkSight& sight, const SightNoise& noise,
              const CameraMotion& motion)
      : model_(model), motion_(motion), sight_(sight, noise) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Pose3d map_T_anchor = PoseOfBlock(blocks[0]);
    const Pose3d map_T_imu = PoseOfBlock(blocks[1]);
    const double inverse_depth = blocks[2][2];
    const SeenRay seen = RayFrom(model_, map_T_anchor, map_T_imu, blocks[2]);
    const std::optional<Prediction> predicted =
        PredictionOf(model_, motion_, seen.ray_camera, inverse_depth, blocks[3]);
    if (!predicted.has_value()) return false;
    sight_.WriteMiss(predicted->sight, residuals);
    if (jacobians == nullptr) return true;
    WriteRayJacobians<kRows>(model_, seen, map_T_anchor, map_T_imu, inverse_depth, *predicted,
                             sight_, jacobians);
    WriteErrorJacobian<kRows>(*predicted, sight_, jacobians[3]);
    return true;
  }

 private:
  const StereoModel model_;
  const CameraMotion motion_;
  const WeighedSight<kRows> sight_;
};

template <int kRows>
class AnchorFactor
    : public ceres::SizedCostFunction<kRows, kLandmarkBlockSize, kCalibrationErrorSize> {
 public:
  AnchorFactor(const StereoModel& model, const LandmarkSight& sight, const SightNoise& noise,
               const CameraMotion& motion)
      : model_(model), motion_(motion), sight_(sight, noise) {}

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Vector3d ray(blocks[0][0], blocks[0][1], 1.0);
    const std::optional<Prediction> predicted =
        PredictionOf(model_, motion_, ray, blocks[0][2], blocks[1]);
    if (!predicted.has_value()) return false;
    sight_.WriteMiss(predicted->sight, residuals);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Matrix3d by_landmark;
      by_landmark << predicted->by_ray.leftCols<2>(), predicted->by_inverse_depth;
      Eigen::Map<Eigen::Matrix<double, kRows, kLandmarkBlockSize, Eigen::RowMajor>>{jacobians[0]} =
          sight_.Weighed(by_landmark);
    }
    WriteErrorJacobian<kRows>(*predicted, sight_, jacobians[1]);
    return true;
  }

 private:
  const StereoModel model_;
  const CameraMotion motion_;
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

double DisparityOf(const StereoModel& model, const CalibrationError& error, double inverse_depth) {
  return model.fx * model.baseline_m * (1.0 + error[1]) * inverse_depth + error[0];
}

double InverseDepthOf(const StereoModel& model, const CalibrationError& error,
                      double disparity_px) {
  return (disparity_px - error[0]) / (model.fx * model.baseline_m * (1.0 + error[1]));
}

std::unique_ptr<ceres::CostFunction> MakeSightFactor(const StereoModel& model,
                                                     const LandmarkSight& sight,
                                                     const SightNoise& noise,
                                                     const CameraMotion& motion) {
  if (sight.disparity_px.has_value()) {
    return std::make_unique<SightFactor<3>>(model, sight, noise, motion);
  }
  return std::make_unique<SightFactor<2>>(model, sight, noise, motion);
}

std::unique_ptr<ceres::CostFunction> MakeAnchorFactor(const StereoModel& model,
                                                      const LandmarkSight& sight,
                                                      const SightNoise& noise,
                                                      const CameraMotion& motion) {
  if (sight.disparity_px.has_value()) {
    return std::make_unique<AnchorFactor<3>>(model, sight, noise, motion);
  }
  return std::make_unique<AnchorFactor<2>>(model, sight, noise, motion);
}

std::optional<Vector3d> SightErrorOf(const StereoModel& model, const Pose3d& map_T_anchor,
                                     const Pose3d& map_T_imu, const LandmarkSight& sight,
                                     const CameraMotion& motion, const LandmarkBlock& landmark,
                                     const CalibrationError& error) {
  const Vector3d ray = RayFrom(model, map_T_anchor, map_T_imu, landmark.data()).ray_camera;
  const auto predicted = PredictionOf(model, motion, ray, landmark[2], error.data());
  if (!predicted.has_value()) return std::nullopt;
  const Vector3d& seen = predicted->sight;
  return Vector3d(seen.x() - sight.pixel.x(), seen.y() - sight.pixel.y(),
                  seen.z() - sight.disparity_px.value_or(seen.z()));
}

}  // namespace dsg::ingest
