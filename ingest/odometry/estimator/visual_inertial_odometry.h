// SPDX-License-Identifier: Apache-2.0
// Where a robot is, from the images of a stereo or depth camera and an inertial unit on it.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/estimator/odometry.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/odometry/estimator/seen_features.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Features followed from image to image, checked and solved at keyframes in a window with what the
/// inertial unit measured; between keyframes the unit's samples lead on. The odometry frame's z
/// axis points up: position and heading drift. The poses before a start in motion are those of the
/// start, and come together with it.
///
/// While too little is seen the unit leads on for `blind_ns_max`; then, and after a gap in its
/// samples, there are no poses until a new start, which goes on at the last position and, with the
/// gyroscope, heading, with a covariance that has grown meanwhile.
///
/// Memory: three image pyramids and a window. Threads: one caller at a time.
/// Source: RSS 2020, section V-A (Kimera-VIO's structure).
class VisualInertialOdometry : public Odometry {
 public:
  /// `camera` is rectified, with poses on the body like that of `imu`.
  /// Errors: FIELD_INVALID for a calibration that is not valid, and for options out of range.
  static absl::StatusOr<VisualInertialOdometry> Make(const StereoCamera& camera,
                                                     const ImuCalibration& imu,
                                                     const OdometryOptions& options);
  ~VisualInertialOdometry() override;
  VisualInertialOdometry(VisualInertialOdometry&&) noexcept;
  VisualInertialOdometry& operator=(VisualInertialOdometry&&) noexcept;

  bool AddSample(const ImuMeasurement& sample) override;
  bool Covers(TimeNs time_ns) const override;
  absl::StatusOr<std::vector<OdometryPose>> AddFrame(const OdometryFrame& frame) override;
  TimeNs waits_from_ns() const override;
  const std::vector<SeenLandmark>& landmarks() const override;
  const OdometryCounts& counts() const override;

 private:
  class Impl;
  explicit VisualInertialOdometry(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
