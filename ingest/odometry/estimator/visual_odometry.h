// SPDX-License-Identifier: Apache-2.0
// Where a robot is, from the images of a depth or stereo camera alone.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/estimator/odometry.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/odometry/estimator/seen_features.h"

namespace dsg::ingest {

/// The body's attitude at which the camera is level: its image's rows are, and it looks ahead along
/// the odometry frame's x axis.
Eigen::Quaterniond LevelAttitude(const StereoCamera& camera);

/// Features followed from image to image; each image's pose is that from which the landmarks are
/// seen where they are (three points, then least squares), and keyframes are solved in a window
/// with their landmarks, which have distances from depth or stereo. The first image with enough of
/// these is the start. What is followed wrongly or moves is no landmark: most features must be at
/// rest.
///
/// Nothing tells what is up: it is what StartAt says, or as if the camera were level at the start;
/// roll and pitch drift as the heading does.
///
/// An image that tells no pose (blurred, covered) has none, and the next one is compared with the
/// last that did. After `blind_ns_max` of that, odometry starts anew where it was last, with a
/// covariance that has grown by `lost_speed_m_s` and `lost_turn_rad_s` meanwhile.
///
/// Samples of a unit are not taken. Memory: three image pyramids and a window. Threads: one caller
/// at a time.
/// Source: RSS 2020, section V-A, without its inertial part; Klein and Murray, 2007 (poses between
/// keyframes from the map alone).
class VisualOdometry : public Odometry {
 public:
  /// `camera` is rectified. Errors: FIELD_INVALID for a calibration that is not valid, and for
  /// options out of range.
  static absl::StatusOr<VisualOdometry> Make(const StereoCamera& camera,
                                             const OdometryOptions& options);
  ~VisualOdometry() override;
  VisualOdometry(VisualOdometry&&) noexcept;
  VisualOdometry& operator=(VisualOdometry&&) noexcept;

  void StartAt(const Eigen::Quaterniond& map_R_body) override;

  bool AddSample(const ImuMeasurement& sample) override;
  bool Covers(TimeNs time_ns) const override;
  absl::StatusOr<std::vector<OdometryPose>> AddFrame(const OdometryFrame& frame) override;
  TimeNs waits_from_ns() const override;
  const std::vector<SeenLandmark>& landmarks() const override;
  const OdometryCounts& counts() const override;

 private:
  class Impl;
  explicit VisualOdometry(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
