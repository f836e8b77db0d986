// SPDX-License-Identifier: Apache-2.0
// How visual-inertial odometry begins: at rest, or in motion from the poses that stereo tells.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/odometry/estimator/seen_features.h"
#include "ingest/odometry/inertial/alignment.h"
#include "ingest/odometry/inertial/preintegration.h"
#include "ingest/sensor/imu_measurement.h"

namespace dsg::ingest {

/// A keyframe from before the start.
struct EarlyKeyframe {
  TimeNs time_ns = 0;
  SeenFeatures features;
  /// Of the left camera, in its frame at the first keyframe; by stereo alone.
  Pose3d first_T_camera;
};

/// Where an earlier stretch of the log has ended: position and heading of the unit, and how sure.
struct StartPlace {
  Pose3d map_T_imu;
  Matrix15d covariance = Matrix15d::Zero();
  bool is_first = true;
};

/// The state at the first of `keyframes`, and the unit's measurements between them.
struct OdometryBegin {
  AlignedState first;
  std::vector<EarlyKeyframe> keyframes;
  std::vector<Preintegration> measured;
  bool is_in_motion = false;
};

/// Keyframes that wait for a start. Threads: one caller at a time.
class OdometryStart {
 public:
  OdometryStart(const StereoCamera& camera, const ImuCalibration& imu,
                const OdometryOptions& options)
      : camera_(camera), imu_(imu), options_(options) {}

  /// After what was added last; no keyframe if there is none.
  TimeNs first_ns() const { return keyframes_.front().time_ns; }
  TimeNs last_ns() const { return keyframes_.back().time_ns; }
  bool empty() const { return keyframes_.empty(); }
  const SeenFeatures& last_features() const { return keyframes_.back().features; }

  /// Forgets those before if stereo does not tell how the camera has moved since, and the oldest
  /// one if there are more than a start in motion takes.
  void Add(TimeNs time_ns, SeenFeatures features, const Eigen::Quaterniond& last_R_now);
  void Clear() { keyframes_.clear(); }

  /// A start at the newest keyframe or with the last ones. `samples` reach from before the first
  /// keyframe to the newest one.
  /// Errors: FAILED_PRECONDITION while there are too few keyframes; of AlignInMotion.
  absl::StatusOr<OdometryBegin> Try(std::span<const ImuMeasurement> samples,
                                    const StartPlace& place);

  /// What the turns between the newest keyframes, also of tries before, tell of the gyro
  /// (FaultsOfTurns): a sentence, or empty.
  std::string GyroFault() const;

 private:
  /// What the images tell, for who wonders why there is no start.
  std::string SeenText() const;
  void KeepTurn(std::span<const ImuMeasurement> samples);
  std::optional<OdometryBegin> TryAtRest(std::span<const ImuMeasurement> samples,
                                         const StartPlace& place) const;
  absl::StatusOr<OdometryBegin> TryInMotion(std::span<const ImuMeasurement> samples,
                                            const StartPlace& place) const;

  StereoCamera camera_;
  ImuCalibration imu_;
  OdometryOptions options_;
  std::vector<EarlyKeyframe> keyframes_;
  // Of the newest keyframe: features, those with a distance, and those that the one before saw.
  size_t feature_count_ = 0;
  int64_t distance_count_ = 0;
  int64_t shared_count_ = 0;
  struct Turn {
    std::vector<ImuMeasurement> samples;
    Eigen::Quaterniond from_R_to;
  };
  std::deque<Turn> turns_;
};

}  // namespace dsg::ingest
