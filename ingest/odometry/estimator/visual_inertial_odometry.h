// SPDX-License-Identifier: Apache-2.0
// Where a robot is, from the images of a stereo or depth camera and an inertial unit on it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/odometry/estimator/seen_features.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// An image to be placed.
struct OdometryFrame {
  TimeNs time_ns = 0;
  /// Grey, as the rectified left camera takes it.
  Image left;
  /// Asked at keyframes only: disparities at pixels of `left`, in their order, unset where there is
  /// none or it is not clear.
  std::function<absl::StatusOr<std::vector<std::optional<double>>>(
      const Image& left, std::span<const Eigen::Vector2d> pixels)>
      disparities;
  /// Of FeatureTracker: a byte for each pixel, not 0 where something moves; may be empty.
  std::vector<uint8_t> mask;
};

/// Where the robot was at an image.
struct OdometryPose {
  TimeNs time_ns = 0;
  /// Of the inertial unit in the odometry frame, whose z axis points up and which begins where the
  /// log begins; with velocity and biases.
  InertialState state;
  /// Rows as in a state. It grows from the start on: position and heading drift.
  Matrix15d covariance = Matrix15d::Zero();
  bool is_keyframe = false;
};

struct OdometryCounts {
  int64_t frames = 0;
  int64_t keyframes = 0;
  /// Frames without a pose: before a start, and while nothing was known.
  int64_t unplaced = 0;
  int64_t starts_at_rest = 0;
  int64_t starts_in_motion = 0;
  /// How often it had to start anew, by reason: "blind", "inertial gap", "no solution".
  std::map<std::string, int64_t> losses;
  /// Why the newest start that was tried in vain failed, in words, and what was wrong with the
  /// gyroscope by then, if that was known (imu_faults.h).
  std::string failed_start;
  std::string gyro_fault;
};

/// Features followed from image to image, checked and solved at keyframes in a window with what the
/// inertial unit measured; between keyframes the unit's samples lead on. A pose is causal: it knows
/// images up to its own. The poses before a start in motion are those of the start, and come
/// together with it.
///
/// While too little is seen the unit leads on for `blind_ns_max`; then, and after a gap in its
/// samples, there are no poses until a new start, which goes on at the last position and, with the
/// gyroscope, heading, with a covariance that has grown meanwhile.
///
/// Counts bound the work, never clocks: the same input gives the same poses.
/// Memory: two image pyramids and a window. Threads: one caller at a time.
/// Source: RSS 2020, section V-A (Kimera-VIO's structure).
class VisualInertialOdometry {
 public:
  /// `camera` is rectified, with poses on the body like that of `imu`.
  /// Errors: FIELD_INVALID for a calibration that is not valid, and for options out of range.
  static absl::StatusOr<VisualInertialOdometry> Make(const StereoCamera& camera,
                                                     const ImuCalibration& imu,
                                                     const OdometryOptions& options);
  ~VisualInertialOdometry();
  VisualInertialOdometry(VisualInertialOdometry&&) noexcept;
  VisualInertialOdometry& operator=(VisualInertialOdometry&&) noexcept;

  /// Samples come in order; false, and nothing happens, for one that is not after the last one or
  /// is not finite.
  bool AddSample(const ImuMeasurement& sample);
  /// Whether samples reach up to that time: frames wait for that.
  bool Covers(TimeNs time_ns) const;

  /// The poses that are known by this frame, ascending; usually one, that of the frame.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for a frame that is not after the last one or does not
  /// fit the camera; of `disparities`.
  absl::StatusOr<std::vector<OdometryPose>> AddFrame(const OdometryFrame& frame);

  /// Of images from then on poses may still come: those of a start that is tried. kTimeMax if there
  /// is none.
  TimeNs waits_from_ns() const;

  const OdometryCounts& counts() const;

 private:
  class Impl;
  explicit VisualInertialOdometry(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
