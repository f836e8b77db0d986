// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/odometry_start.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/estimator/keyframe_sights.h"
#include "ingest/odometry/inertial/imu_faults.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "ingest/odometry/inertial/moving_alignment.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// How sure the origin is of being the origin: a solver wants a covariance.
constexpr double kPlaceSigmaM = 1e-3;
constexpr double kHeadingSigmaRad = 1e-3;

// Of keyframes, to find faults in. More of them tell nothing new.
constexpr size_t kTurnsMax = 100;

// The turn about the vertical that brings one attitude nearest to the other.
double HeadingBetween(const Quaterniond& from, const Quaterniond& to) {
  const Eigen::Matrix3d turn = (to * from.conjugate()).toRotationMatrix();
  return std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
}

// What the state at the beginning is sure of when nothing of it is told but by the images around.
Matrix15d CovarianceInMotion(const Vector3d& up_imu, const OdometryStartOptions& options) {
  const auto square = [](double value) { return Vector3d::Constant(value * value); };
  Matrix15d covariance = Matrix15d::Zero();
  covariance.diagonal().segment<3>(kPositionRow) = square(kPlaceSigmaM);
  covariance.diagonal().segment<3>(kRotationRow) = square(options.tilt_rad);
  covariance.block<3, 3>(kRotationRow, kRotationRow) -=
      (options.tilt_rad * options.tilt_rad - kHeadingSigmaRad * kHeadingSigmaRad) * up_imu *
      up_imu.transpose();
  covariance.diagonal().segment<3>(kVelocityRow) = square(options.velocity_m_s);
  covariance.diagonal().segment<3>(kGyroBiasRow) = square(options.gyro_bias_rad_s);
  covariance.diagonal().segment<3>(kAccelBiasRow) = square(options.accel_bias_m_s2);
  return covariance;
}

// Brings the start to where an earlier stretch has ended, and its covariance with it. `end_T_imu`
// is the newest pose of the start, in its own map.
void MoveTo(const StartPlace& place, const Pose3d& end_T_imu, AlignedState* aligned) {
  InertialState& state = aligned->state;
  if (place.is_first) {
    state.map_T_imu.position.setZero();
    return;
  }
  const Quaterniond turn = RotationOf(
      HeadingBetween(end_T_imu.orientation, place.map_T_imu.orientation) * Vector3d::UnitZ());
  state.map_T_imu.position =
      place.map_T_imu.position + turn * (state.map_T_imu.position - end_T_imu.position);
  state.map_T_imu.orientation = (turn * state.map_T_imu.orientation).normalized();
  state.velocity_map = turn * state.velocity_map;
  const Eigen::Matrix3d turned = turn.toRotationMatrix();
  auto velocity = aligned->covariance.block<3, 3>(kVelocityRow, kVelocityRow);
  velocity = (turned * velocity * turned.transpose()).eval();
  aligned->covariance.block<3, 3>(kPositionRow, kPositionRow) +=
      place.covariance.block<3, 3>(kPositionRow, kPositionRow);
  // Of the heading alone: the tilt is known anew.
  const auto up_in = [](const Quaterniond& map_R_imu) -> Vector3d {
    return map_R_imu.conjugate() * Vector3d::UnitZ();
  };
  const Vector3d place_up = up_in(place.map_T_imu.orientation);
  const Vector3d up_imu = up_in(state.map_T_imu.orientation);
  const double heading =
      place_up.dot(place.covariance.block<3, 3>(kRotationRow, kRotationRow) * place_up);
  aligned->covariance.block<3, 3>(kRotationRow, kRotationRow) +=
      heading * up_imu * up_imu.transpose();
}

}  // namespace

void OdometryStart::Add(TimeNs time_ns, SeenFeatures features, const Quaterniond& last_R_now) {
  feature_count_ = features.size();
  distance_count_ = std::count_if(features.begin(), features.end(), [](const auto& entry) {
    return entry.second.disparity_px.has_value();
  });
  shared_count_ = keyframes_.empty() ? 0 : SharedCount(keyframes_.back().features, features);
  EarlyKeyframe keyframe{time_ns, std::move(features), Pose3d()};
  if (!keyframes_.empty()) {
    const EarlyKeyframe& last = keyframes_.back();
    const StereoMotion motion =
        StereoMotionOf(camera_, last.features, keyframe.features, last_R_now,
                       OdometryMethod::kFivePoint, options_.frontend.relative_pose);
    if (motion.outcome == PoseOutcome::kFound) {
      keyframe.first_T_camera = last.first_T_camera * motion.last_T_now;
      for (const int64_t id : motion.outliers) keyframe.features[id].disparity_px.reset();
    } else {
      keyframes_.clear();
    }
  }
  keyframes_.push_back(std::move(keyframe));
  // A start that does not come must not fill the memory.
  const auto count_max = static_cast<size_t>(options_.start.keyframe_count);
  if (keyframes_.size() > count_max) keyframes_.erase(keyframes_.begin());
}

absl::StatusOr<OdometryBegin> OdometryStart::Try(std::span<const ImuMeasurement> samples,
                                                 const StartPlace& place) {
  KeepTurn(samples);
  std::optional<OdometryBegin> begin = TryAtRest(samples, place);
  if (begin.has_value()) return *std::move(begin);
  return TryInMotion(samples, place);
}

std::string OdometryStart::SeenText() const {
  return absl::StrCat("the newest image shows ", feature_count_, " features, of which ",
                      distance_count_, " have a distance (few: look at the calibration and at the ",
                      "stamps of both cameras) and ", shared_count_,
                      " were in the keyframe before (few: images are too rare or too blurred)");
}

void OdometryStart::KeepTurn(std::span<const ImuMeasurement> samples) {
  if (keyframes_.size() < 2) return;
  const EarlyKeyframe& from = keyframes_[keyframes_.size() - 2];
  const EarlyKeyframe& to = keyframes_.back();
  absl::StatusOr<std::vector<ImuMeasurement>> between =
      CutSamples(samples, from.time_ns, to.time_ns, imu_.name, options_.inertial.gap_ns_max);
  if (!between.ok()) return;
  const Quaterniond imu_R_camera =
      imu_.body_T_imu.orientation.conjugate() * camera_.left.body_T_camera.orientation;
  const Quaterniond camera_turn =
      from.first_T_camera.orientation.conjugate() * to.first_T_camera.orientation;
  turns_.push_back(
      {*std::move(between), (imu_R_camera * camera_turn * imu_R_camera.conjugate()).normalized()});
  if (turns_.size() > kTurnsMax) turns_.pop_front();
}

std::string OdometryStart::GyroFault() const {
  std::vector<SeenTurn> seen;
  for (const Turn& turn : turns_) seen.push_back({turn.samples, turn.from_R_to});
  const std::vector<ImuFault> faults = FaultsOfTurns(seen, imu_.name, options_.inertial);
  return faults.empty() ? "" : faults.front().text;
}

// The unit alone cannot tell rest from an even ride; images can.
std::optional<OdometryBegin> OdometryStart::TryAtRest(std::span<const ImuMeasurement> samples,
                                                      const StartPlace& place) const {
  const EarlyKeyframe& newest = keyframes_.back();
  const TimeNs from_ns = newest.time_ns - options_.inertial.rest_ns;
  const auto first = std::find_if(keyframes_.begin(), keyframes_.end(),
                                  [&](const EarlyKeyframe& k) { return k.time_ns >= from_ns; });
  const bool is_long = newest.time_ns - first->time_ns >= options_.inertial.rest_ns / 2;
  if (!is_long || static_cast<int>(newest.features.size()) < options_.keyframe.sight_count_min) {
    return std::nullopt;
  }
  const std::optional<double> parallax_px =
      ParallaxOf(camera_, first->features, newest.features, Quaterniond::Identity());
  if (!parallax_px.has_value() || *parallax_px > options_.frontend.relative_pose.parallax_px_min) {
    return std::nullopt;
  }
  std::vector<ImuMeasurement> still;
  for (const ImuMeasurement& sample : samples) {
    if (sample.time_ns >= from_ns && sample.time_ns <= newest.time_ns) still.push_back(sample);
  }
  absl::StatusOr<AlignedState> aligned = AlignAtRest(still, imu_, 0.0, options_.inertial);
  if (!aligned.ok()) return std::nullopt;
  OdometryBegin begin;
  begin.first = *std::move(aligned);
  MoveTo(place, begin.first.state.map_T_imu, &begin.first);
  begin.keyframes = {newest};
  begin.keyframes.front().first_T_camera = Pose3d();
  return begin;
}

absl::StatusOr<OdometryBegin> OdometryStart::TryInMotion(std::span<const ImuMeasurement> samples,
                                                         const StartPlace& place) const {
  const auto count = static_cast<size_t>(options_.start.keyframe_count);
  if (keyframes_.size() < count) {
    return absl::FailedPreconditionError(
        absl::StrCat("images tell the motion of ", keyframes_.size(),
                     " keyframes; a start in motion takes ", count, "; ", SeenText()));
  }
  OdometryBegin begin;
  begin.is_in_motion = true;
  begin.keyframes.assign(keyframes_.end() - options_.start.keyframe_count, keyframes_.end());
  const Pose3d camera_T_imu = camera_.left.body_T_camera.Inverse() * imu_.body_T_imu;
  std::vector<Pose3d> poses;
  for (size_t i = 0; i < count; ++i) {
    poses.push_back(begin.keyframes[i].first_T_camera * camera_T_imu);
    if (i == 0) continue;
    DSG_ASSIGN_OR_RETURN(
        Preintegration measured,
        Preintegration::Make(samples, begin.keyframes[i - 1].time_ns, begin.keyframes[i].time_ns,
                             ImuBias(), imu_, options_.inertial));
    begin.measured.push_back(std::move(measured));
  }
  std::vector<Preintegration*> between;
  for (Preintegration& measured : begin.measured) between.push_back(&measured);
  DSG_ASSIGN_OR_RETURN(const AlignedPath path,
                       AlignInMotion(poses, between, imu_, 0.0, options_.inertial));
  begin.first.state = path.states.front();
  const Vector3d up_imu = begin.first.state.map_T_imu.orientation.conjugate() * Vector3d::UnitZ();
  begin.first.covariance = CovarianceInMotion(up_imu, options_.start);
  MoveTo(place, path.states.back().map_T_imu, &begin.first);
  return begin;
}

}  // namespace dsg::ingest
