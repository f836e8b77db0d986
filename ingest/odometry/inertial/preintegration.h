// SPDX-License-Identifier: Apache-2.0
// The inertial samples between two instants as one measurement that does not depend on where the
// unit was: on-manifold preintegration.
// Source: Forster, Carlone, Dellaert, Scaramuzza, T-RO 2017.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Where the unit is at the end, in the frame that it had at the beginning, as if it had begun at
/// rest and nothing had weight.
struct ImuIncrement {
  /// m.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  /// m/s.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

/// Integrated once, from biases that are only known roughly; better ones correct it to first order.
///
/// Between two samples rates and forces are taken as the mean of both. The force is turned by the
/// orientation in the middle of the step: by the one at its beginning, as in the paper, a turn of
/// 1 rad/s at 200 Hz would leave 0.025 m/s of gravity behind after a second, ten times the noise.
///
/// Cost: about 8 us a sample. Threads: safe while nobody reintegrates.
class Preintegration {
 public:
  /// `samples` ascend strictly and reach from `from_ns` or before to `to_ns` or after; what lies
  /// outside is left out, and samples are interpolated at both ends.
  ///
  /// Errors, which name the unit, the time and the value: TIME_RANGE_INVERTED; FIELD_INVALID for a
  /// calibration without noise, times that do not ascend, gaps above options.gap_ns_max, and
  /// numbers that are not finite or overflow; OUT_OF_RANGE/TIME_OUTSIDE_TRACK when samples do not
  /// cover the interval (yet).
  static absl::StatusOr<Preintegration> Make(std::span<const ImuMeasurement> samples,
                                             TimeNs from_ns, TimeNs to_ns, const ImuBias& bias,
                                             const ImuCalibration& calibration,
                                             const InertialOptions& options);

  TimeNs from_ns() const { return samples_.front().time_ns; }
  TimeNs to_ns() const { return samples_.back().time_ns; }
  double duration_s() const { return duration_s_; }

  /// As they were measured; the first and the last one are interpolated.
  std::span<const ImuMeasurement> samples() const { return samples_; }
  /// What was subtracted from the samples.
  const ImuBias& bias() const { return bias_; }
  const ImuIncrement& increment() const { return increment_; }
  /// Of position, rotation (on the right) and velocity of the increment, by gyro and accelerometer
  /// bias.
  const Eigen::Matrix<double, 9, 6>& bias_jacobian() const { return bias_jacobian_; }
  /// Of what is true minus what was integrated, rows as in a state but in the frame at the
  /// beginning: white noise, biases that walk on, and how far they have walked at the end. It takes
  /// the biases at the beginning as known.
  const Matrix15d& covariance() const { return covariance_; }
  /// whitening * covariance * whitening' = identity; lower triangular.
  const Matrix15d& whitening() const { return whitening_; }

  /// The increment for other biases, to first order.
  ImuIncrement CorrectedFor(const ImuBias& bias) const;
  /// Whether the first order is no longer enough.
  bool IsFarFrom(const ImuBias& bias) const;
  /// Starts anew from the samples. Errors: FIELD_INVALID when the numbers overflow; this is as
  /// before then.
  absl::Status Reintegrate(const ImuBias& bias);

  /// The state at the end. `covariance`, if given, is that of `from` and becomes that of the state
  /// at the end; position and velocity in map axes, rotation on the right.
  InertialState Predict(const InertialState& from, const Eigen::Vector3d& gravity_map,
                        Matrix15d* covariance) const;

 private:
  Preintegration() = default;
  void Integrate(const ImuMeasurement& from, const ImuMeasurement& to);

  /// The first and the last one are interpolated.
  std::vector<ImuMeasurement> samples_;
  ImuCalibration calibration_;
  double gyro_bias_shift_max_ = 0.0;
  double accel_bias_shift_max_ = 0.0;
  ImuBias bias_;
  double duration_s_ = 0.0;
  ImuIncrement increment_;
  Eigen::Matrix<double, 9, 6> bias_jacobian_ = Eigen::Matrix<double, 9, 6>::Zero();
  Matrix15d covariance_ = Matrix15d::Zero();
  Matrix15d whitening_ = Matrix15d::Zero();
};

}  // namespace dsg::ingest
