// SPDX-License-Identifier: Apache-2.0
// The last keyframes of a stereo camera, with an inertial unit or without, estimated together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/inertial/alignment.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/odometry/inertial/preintegration.h"
#include "ingest/odometry/window/landmark_factor.h"
#include "ingest/odometry/window/seen_landmark.h"
#include "ingest/odometry/window/window_landmarks.h"
#include "ingest/odometry/window/window_options.h"
#include "ingest/solver/pose_block.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Fixed-lag smoothing: poses, velocities, biases and landmarks of the last keyframes are the least
/// squares of what the unit and the images measured and of a prior, which is what older keyframes
/// have left (marginalization.h). Without a unit keyframes are poses alone, which their landmarks
/// tie together; its frame is then that of the body. The same calls give the same numbers, whatever
/// the number of threads.
///
/// A landmark is eliminated with the keyframe that saw it first. A feature that is followed on
/// becomes a new landmark, from its next sight on, so that nothing counts twice. What is wrong with
/// the calibration is estimated, too: near and far landmarks tell an offset of disparities, the
/// unit tells the baseline where it is accelerated, and the offset of its clock where it turns.
/// Poses are those of the stamps on the clock of the unit. Without a unit baseline and stamps stay
/// what they are said to be.
///
/// Memory: keyframes times their features. Threads: one caller at a time.
/// Source: RSS 2020, section V-A; Leutenegger and others, IJRR 2015 (fixed lag, marginalised).
class SlidingWindow {
 public:
  SlidingWindow(const StereoModel& model, const Eigen::Vector3d& gravity_map,
                const WindowOptions& options);
  ~SlidingWindow();
  SlidingWindow(SlidingWindow&&) noexcept;
  SlidingWindow& operator=(SlidingWindow&&) noexcept;

  /// Begins anew with one keyframe. Errors: FIELD_INVALID when the covariance is not positive
  /// definite.
  absl::Status Begin(TimeNs time_ns, const AlignedState& aligned,
                     std::span<const FeatureSight> sights);
  /// The same without a unit; rows of the covariance as in a pose block's step. All keyframes until
  /// the next Begin are added without one.
  absl::Status BeginByImages(TimeNs time_ns, const Pose3d& map_T_imu, const Matrix6d& covariance,
                             std::span<const FeatureSight> sights);

  /// A keyframe after the last one; `measured` reaches from that one to this. Solves, drops
  /// landmarks that do not fit, and the oldest keyframe if there are too many.
  ///
  /// Errors: FIELD_INVALID when times do not fit or numbers are not finite; begin anew then.
  /// Cost: keyframes times features, and the cube of the keyframes.
  absl::Status Add(TimeNs time_ns, Preintegration measured, std::span<const FeatureSight> sights);
  /// The same without a unit: `guess` is where the solver begins, and says nothing itself. Errors:
  /// as Add; after Begin.
  absl::Status AddByImages(TimeNs time_ns, const Pose3d& guess,
                           std::span<const FeatureSight> sights);

  int keyframe_count() const;
  /// Require: Begin.
  TimeNs newest_ns() const;
  InertialState newest() const;
  /// Of the newest state; rows as in a state. Cost: a few milliseconds.
  /// Errors: FIELD_INVALID when it is not finite.
  absl::StatusOr<Matrix15d> NewestCovariance() const;
  /// The same of the newest pose alone, with a unit or without.
  absl::StatusOr<Matrix6d> NewestPoseCovariance() const;

  /// Where a feature's landmark is, map; nullopt while its distance is not known.
  std::optional<Eigen::Vector3d> PointOf(int64_t feature_id) const;

  /// By how much the estimate misses what was measured, in squares of standard deviations, for each
  /// measurement that is more than enough to tell the states: about 1, or less, where the noise is
  /// what it is said to be. Of the last Add.
  double misfit() const;

  /// As it is known by now.
  const CalibrationError& calibration_error() const;

  /// Features that the last Add found to be wrong, ascending: landmarks that miss their images.
  const std::vector<int64_t>& dropped_features() const;

  /// With a distance, ascending by feature, as the last Begin or Add has left them; those that the
  /// oldest keyframe saw first are still among them when it has just become a prior.
  const std::vector<SeenLandmark>& landmarks() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
