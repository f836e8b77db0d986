// SPDX-License-Identifier: Apache-2.0
// What all odometries of a camera have in common: images in, poses of the robot out.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/window/seen_landmark.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/imu_measurement.h"
#include "ingest/solver/pose_block.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

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
  /// How much later than `left` that was measured which disparities are read from, ns, negative if
  /// earlier: of depth cameras, which have a clock of their own.
  TimeNs depth_late_ns = 0;
  /// Of FeatureTracker: a byte for each pixel, not 0 where something moves; may be empty.
  std::vector<uint8_t> mask;
};

/// Where the robot was at an image.
struct OdometryPose {
  TimeNs time_ns = 0;
  /// Of the robot's body in the odometry frame, which begins where the log begins. Its z axis
  /// points up as far as the odometry knows: an inertial unit tells, images do not.
  Pose3d map_T_body;
  /// Rows as in the step of a pose block. It grows from the start on.
  Matrix6d covariance = Matrix6d::Zero();
  bool is_keyframe = false;
};

struct OdometryCounts {
  int64_t frames = 0;
  int64_t keyframes = 0;
  /// Frames without a pose: before a start, and while nothing was known.
  int64_t unplaced = 0;
  int64_t starts_at_rest = 0;
  int64_t starts_in_motion = 0;
  /// Without an inertial unit it is the same.
  int64_t starts_by_images = 0;
  /// How often it had to start anew, by reason: "blind", "inertial gap", "no solution", "clipped
  /// samples", "samples that stand still", "disagreement" of unit and images.
  std::map<std::string, int64_t> losses;
  /// Keyframes at which most of what was seen moved otherwise than the path: covariances are larger
  /// since.
  int64_t doubts = 0;
  /// By how much images are later than their stamps on the clock of the unit, seconds, as the
  /// newest keyframe tells it.
  double image_late_s = 0.0;
  /// Why the newest start that was tried in vain failed, in words, and what was wrong with the
  /// gyroscope by then, if that was known (imu_faults.h); empty without a unit.
  std::string failed_start;
  std::string gyro_fault;
};

/// A pose is causal: it knows images up to its own. Counts bound the work, never clocks: the same
/// input gives the same poses. Threads: one caller at a time.
class Odometry {
 public:
  virtual ~Odometry() = default;

  /// The body's attitude at the first image, before that; of odometries that cannot tell what is
  /// up.
  virtual void StartAt(const Eigen::Quaterniond& /*map_R_body*/) {}

  /// Samples come in order; false, and nothing happens, for one that is not after the last one, is
  /// not finite or beyond what InertialOptions takes, and without a unit.
  virtual bool AddSample(const ImuMeasurement& sample) = 0;
  /// Whether samples reach up to that time: frames wait for that. Always true without a unit.
  virtual bool Covers(TimeNs time_ns) const = 0;

  /// The poses that are known by this frame, ascending; usually one, that of the frame.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for a frame that is not after the last one or does not
  /// fit the camera; of `disparities`.
  virtual absl::StatusOr<std::vector<OdometryPose>> AddFrame(const OdometryFrame& frame) = 0;

  /// Of images from then on poses may still come: those of a start that is tried. kTimeMax if there
  /// is none.
  virtual TimeNs waits_from_ns() const = 0;

  /// Of the window at the newest keyframe, ascending by feature, in the frame of the poses. Before
  /// the first start there are none.
  virtual const std::vector<SeenLandmark>& landmarks() const = 0;

  virtual const OdometryCounts& counts() const = 0;
};

}  // namespace dsg::ingest
