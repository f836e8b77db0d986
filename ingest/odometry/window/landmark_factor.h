// SPDX-License-Identifier: Apache-2.0
// How far a landmark is from where a stereo camera saw it, as a cost function.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>

#include "ingest/sensor/calibration.h"
#include "ingest/sensor/rectified_pair.h"
#include "schema/model/geometry.h"

namespace ceres {
class CostFunction;
}

namespace dsg::ingest {

/// A rectified stereo camera on the body of an inertial unit.
struct StereoModel {
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  /// Distance of both cameras, metres; > 0.
  double baseline_m = 0.0;
  /// Of the rectified left camera.
  Pose3d imu_T_camera;

  /// Requires: `left` has no distortion.
  static StereoModel Make(const CameraCalibration& left, double baseline_m,
                          const Pose3d& body_T_imu);

  /// Through the pixel, with z = 1, in the camera's frame.
  Eigen::Vector3d RayOf(const Eigen::Vector2d& pixel) const;
};

/// What is wrong with the calibration, as a parameter block: pixels that all disparities are too
/// large by (0.1 degrees between the cameras make one), the share by which the baseline is longer
/// than it is said to be, and the seconds by which images are later than their stamps say, on the
/// clock of the unit.
inline constexpr int kCalibrationErrorSize = 3;
using CalibrationError = std::array<double, kCalibrationErrorSize>;

/// How the camera moves, in its own frame: rad/s and m/s. Between the stamp of an image and the
/// instant at which it was taken that does not change.
/// Source: Li and Mourikis, IJRR 2014 (the offset of clocks as a state).
struct CameraMotion {
  Eigen::Vector3d turn_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d speed_m_s = Eigen::Vector3d::Zero();
};

/// Of a point at 1 / inverse_depth along the optical axis, pixels; and back.
double DisparityOf(const StereoModel& model, const CalibrationError& error, double inverse_depth);
double InverseDepthOf(const StereoModel& model, const CalibrationError& error, double disparity_px);

/// Where a landmark was seen. Pixels of the rectified left camera.
struct LandmarkSight {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  /// Unset: the right camera did not see it, or not clearly.
  std::optional<double> disparity_px;
};

/// Standard deviations, pixels.
struct SightNoise {
  double pixel_px = 1.0;
  double disparity_px = 1.0;
};

/// A landmark as a parameter block: where the ray to it crosses z = 1 before the camera that saw it
/// first (its anchor), column and row, and its inverse depth along the optical axis, 1/m. 0 is
/// infinitely far.
/// Source: Civera, Davison and Montiel, 2008.
inline constexpr int kLandmarkBlockSize = 3;
using LandmarkBlock = std::array<double, kLandmarkBlockSize>;

/// By how much the anchor's own sight is missed, in standard deviations: column, row, and the
/// disparity if it has one. Blocks: the landmark, the calibration error.
std::unique_ptr<ceres::CostFunction> MakeAnchorFactor(const StereoModel& model,
                                                      const LandmarkSight& sight,
                                                      const SightNoise& noise,
                                                      const CameraMotion& motion);

/// The same of another image. Blocks: pose of the anchor, pose of that image (pose_block.h), the
/// landmark, the calibration error.
///
/// Fails to evaluate where the landmark is not before the camera.
std::unique_ptr<ceres::CostFunction> MakeSightFactor(const StereoModel& model,
                                                     const LandmarkSight& sight,
                                                     const SightNoise& noise,
                                                     const CameraMotion& motion);

/// What a landmark is missed by in an image, pixels: column, row, and disparity (0 if it has none);
/// nullopt unless it is before the camera.
std::optional<Eigen::Vector3d> SightErrorOf(const StereoModel& model, const Pose3d& map_T_anchor,
                                            const Pose3d& map_T_imu, const LandmarkSight& sight,
                                            const CameraMotion& motion,
                                            const LandmarkBlock& landmark,
                                            const CalibrationError& error);

}  // namespace dsg::ingest
