// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/visual_inertial_odometry.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/estimator/keyframe_sights.h"
#include "ingest/odometry/estimator/odometry_start.h"
#include "ingest/odometry/estimator/path_doubt.h"
#include "ingest/odometry/frontend/feature_tracker.h"
#include "ingest/odometry/inertial/imu_faults.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "ingest/odometry/inertial/preintegration.h"
#include "ingest/odometry/window/sliding_window.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Quaterniond;

ImuCalibration NoisierUnit(ImuCalibration imu, const OdometryUnitOptions& options) {
  imu.gyro_noise_density *= options.gyro_noise_factor;
  imu.accel_noise_density *= options.accel_noise_factor;
  return imu;
}

// A state of the unit, with what else is known of it.
struct PlacedState {
  TimeNs time_ns = 0;
  InertialState state;
  Matrix15d covariance = Matrix15d::Zero();
  bool is_keyframe = false;
};

}  // namespace

class VisualInertialOdometry::Impl {
 public:
  Impl(const StereoCamera& camera, const ImuCalibration& imu, const OdometryOptions& options,
       FeatureTracker tracker)
      : camera_(camera),
        imu_(NoisierUnit(imu, options.unit)),
        options_(options),
        imu_T_camera_(imu.body_T_imu.Inverse() * camera.left.body_T_camera),
        tracker_(std::move(tracker)),
        window_(StereoModel::Make(camera.left, camera.baseline_m, imu.body_T_imu),
                options.inertial.gravity_map(), options.window),
        start_(camera, imu_, options) {}

  bool AddSample(const ImuMeasurement& sample) {
    const bool is_good =
        sample.angular_velocity_rad_s.allFinite() && sample.acceleration_m_s2.allFinite() &&
        (!is_started_ ||
         (sample.angular_velocity_rad_s.norm() <= options_.inertial.rate_max_rad_s &&
          sample.acceleration_m_s2.norm() <= options_.inertial.force_max_m_s2)) &&
        (samples_.empty() || sample.time_ns > samples_.back().time_ns);
    if (is_good) samples_.push_back(sample);
    return is_good;
  }

  bool Covers(TimeNs time_ns) const {
    return !samples_.empty() && samples_.back().time_ns >= time_ns;
  }

  absl::StatusOr<std::vector<OdometryPose>> AddFrame(const OdometryFrame& frame) {
    if (last_ns_.has_value() && frame.time_ns <= *last_ns_) {
      return BadFrame(frame.time_ns, absl::StrCat("is not after the one at ", *last_ns_, " ns"));
    }
    ++counts_.frames;
    const bool is_tracking = counts_.frames > 1;
    Quaterniond last_R_now = Quaterniond::Identity();
    if (is_tracking) last_R_now = TurnSince(*last_ns_, frame.time_ns);
    last_ns_ = frame.time_ns;
    // Before a start it is not known whether the unit's samples are what they should be.
    const bool is_led = options_.method == OdometryMethod::kDynamic && is_started_;
    DSG_RETURN_IF_ERROR(tracker_
                            .Track(frame.left,
                                   is_led ? std::optional(CameraTurn(last_R_now)) : std::nullopt,
                                   frame.mask)
                            .status());
    keyframe_R_now_ = (keyframe_R_now_ * last_R_now).normalized();
    DSG_ASSIGN_OR_RETURN(const std::vector<PlacedState> states,
                         is_started_ ? Follow(frame) : Wait(frame, last_R_now));
    if (states.empty()) ++counts_.unplaced;
    std::vector<OdometryPose> poses;
    for (const PlacedState& state : states) poses.push_back(PoseOf(state));
    return poses;
  }

  TimeNs waits_from_ns() const {
    return is_started_ || start_.empty() ? kTimeMax : start_.first_ns();
  }
  const std::vector<SeenLandmark>& landmarks() const { return window_.landmarks(); }
  const OdometryCounts& counts() const { return counts_; }

 private:
  // Of the body, from that of the unit, which sits elsewhere on it.
  OdometryPose PoseOf(const PlacedState& placed) const {
    const Pose3d imu_T_body = imu_.body_T_imu.Inverse();
    const Pose3d& map_T_imu = placed.state.map_T_imu;
    const Matrix6d covariance = placed.covariance.topLeftCorner<6, 6>();
    return {placed.time_ns, map_T_imu * imu_T_body,
            options_.unit.covariance_factor * CovarianceAt(covariance, map_T_imu, imu_T_body) +
                doubt_.At(map_T_imu * imu_T_body),
            placed.is_keyframe};
  }

  // Of the unit, by the gyroscope; none where its samples say nothing.
  Quaterniond TurnSince(TimeNs from_ns, TimeNs to_ns) {
    const absl::StatusOr<Preintegration> measured = Integrate(from_ns, to_ns);
    has_turn_ = measured.ok();
    return has_turn_ ? measured->CorrectedFor(bias_).rotation : Quaterniond::Identity();
  }

  absl::StatusOr<Preintegration> Integrate(TimeNs from_ns, TimeNs to_ns) const {
    return Preintegration::Make(samples_, from_ns, to_ns, bias_, imu_, options_.inertial);
  }

  Quaterniond CameraTurn(const Quaterniond& imu_turn) const {
    const Quaterniond& mount = imu_T_camera_.orientation;
    return (mount.conjugate() * imu_turn * mount).normalized();
  }

  bool IsKeyframeDue(TimeNs time_ns, TimeNs keyframe_ns, const SeenFeatures& last) const {
    const TimeNs span_ns = time_ns - keyframe_ns;
    if (span_ns < options_.keyframe.period_ns_min) return false;
    if (span_ns >= options_.keyframe.period_ns_max) return true;
    return HasMoved(camera_, last, FeaturesOf(tracker_), CameraTurn(keyframe_R_now_),
                    options_.keyframe);
  }

  // --- Before a start.

  absl::StatusOr<std::vector<PlacedState>> Wait(const OdometryFrame& frame,
                                                const Quaterniond& last_R_now) {
    GoOnLost(frame.time_ns, last_R_now, has_turn_);
    if (!has_turn_) start_.Clear();
    early_ns_.push_back(frame.time_ns);
    const bool is_due =
        start_.empty() || frame.time_ns - start_.last_ns() >= options_.keyframe.period_ns_min;
    if (!is_due) return std::vector<PlacedState>();
    DSG_ASSIGN_OR_RETURN(SeenFeatures features, SeeKeyframe(frame, camera_.left, &tracker_));
    start_.Add(frame.time_ns, std::move(features), CameraTurn(keyframe_R_now_));
    keyframe_R_now_ = Quaterniond::Identity();
    std::erase_if(early_ns_, [&](TimeNs time_ns) { return time_ns < start_.first_ns(); });
    absl::StatusOr<OdometryBegin> begin = start_.Try(samples_, place_);
    ForgetSamples(frame.time_ns);
    if (!begin.ok()) {
      counts_.failed_start = std::string(begin.status().message());
      counts_.gyro_fault = start_.GyroFault();
      return std::vector<PlacedState>();
    }
    return Begin(*std::move(begin));
  }

  // The poses of a start in motion are those of all images since its first keyframe.
  absl::StatusOr<std::vector<PlacedState>> Begin(OdometryBegin begin) {
    start_.Clear();
    const StartPlace place = place_;
    std::vector<PlacedState> poses;
    const EarlyKeyframe& first = begin.keyframes.front();
    absl::Status status = window_.Begin(first.time_ns, begin.first, SightsOf(first.features));
    if (status.ok() && TakeNewest()) poses.push_back(NewestPose());
    for (size_t i = 1; i < begin.keyframes.size() && status.ok(); ++i) {
      const EarlyKeyframe& next = begin.keyframes[i];
      for (const TimeNs time_ns : early_ns_) {
        if (time_ns <= window_.newest_ns() || time_ns >= next.time_ns) continue;
        DSG_ASSIGN_OR_RETURN(const Preintegration measured,
                             Integrate(window_.newest_ns(), time_ns));
        poses.push_back(PoseAfter(measured));
      }
      status = window_.Add(next.time_ns, std::move(begin.measured[i - 1]), SightsOf(next.features));
      if (status.ok() && TakeNewest()) poses.push_back(NewestPose());
      tracker_.Drop(window_.dropped_features());
    }
    early_ns_.clear();
    if (poses.empty() || poses.back().time_ns != begin.keyframes.back().time_ns) {
      place_ = place;
      return std::vector<PlacedState>();
    }
    is_started_ = true;
    // At rest the values of a simulated unit without noise stand still, and nothing is wrong.
    has_noise_ = !HasFault(ImuFaultKind::kStuck, SamplesSince(lost_ns_.value_or(kTimeMin)));
    counts_.unplaced -= std::ssize(poses) - 1;
    ++(begin.is_in_motion ? counts_.starts_in_motion : counts_.starts_at_rest);
    last_seen_ns_ = window_.newest_ns();
    last_features_ = begin.keyframes.back().features;
    keyframe_R_now_ = Quaterniond::Identity();
    return poses;
  }

  // Where the robot is by and by, while nobody sees it.
  void GoOnLost(TimeNs time_ns, const Quaterniond& last_R_now, bool is_turn_known) {
    if (place_.is_first || !lost_ns_.has_value()) return;
    const double seconds = SecondsBetween(*lost_ns_, time_ns);
    const auto square = [](double value) { return value * value; };
    lost_ns_ = time_ns;
    place_.map_T_imu.orientation = (place_.map_T_imu.orientation * last_R_now).normalized();
    // As a walk whose standard deviation grows with time.
    auto position = place_.covariance.block<3, 3>(kPositionRow, kPositionRow);
    const double sigma = std::sqrt(position(0, 0)) + options_.start.lost_speed_m_s * seconds;
    position.diagonal().setConstant(square(sigma));
    if (is_turn_known) return;
    auto turn = place_.covariance.block<3, 3>(kRotationRow, kRotationRow);
    const double turn_sigma = std::sqrt(turn(2, 2)) + options_.start.lost_turn_rad_s * seconds;
    turn.diagonal().setConstant(std::min(square(M_PI), square(turn_sigma)));
  }

  // --- After it.

  absl::StatusOr<std::vector<PlacedState>> Follow(const OdometryFrame& frame) {
    absl::StatusOr<Preintegration> measured = Integrate(window_.newest_ns(), frame.time_ns);
    if (!measured.ok()) return Lose("inertial gap");
    const PlacedState pose = PoseAfter(*measured);
    if (!IsKeyframeDue(frame.time_ns, window_.newest_ns(), last_features_)) {
      return std::vector<PlacedState>{pose};
    }
    if (HasFault(ImuFaultKind::kClipped, measured->samples())) {
      return LoseSinceKeyframe("clipped samples", frame.time_ns);
    }
    if (has_noise_ && HasFault(ImuFaultKind::kStuck, measured->samples())) {
      return LoseSinceKeyframe("samples that stand still", frame.time_ns);
    }
    DropOutliers();
    DSG_ASSIGN_OR_RETURN(SeenFeatures features, SeeKeyframe(frame, camera_.left, &tracker_));
    const SeenFeatures seen = features;
    const StereoMotion motion = MotionTo(features, OdometryMethod::kFivePoint);
    CheckDistances(motion, &features);
    if (SharedCount(last_features_, features) >= options_.keyframe.sight_count_min)
      last_seen_ns_ = frame.time_ns;
    if (frame.time_ns - last_seen_ns_ > options_.keyframe.blind_ns_max) {
      // The last pose is still told: the unit has led up to it.
      place_ = {pose.state.map_T_imu, pose.covariance, false};
      return Lose("blind");
    }
    const Pose3d map_T_last = window_.newest().map_T_imu;
    const absl::Status added = window_.Add(frame.time_ns, *std::move(measured), SightsOf(features));
    if (!added.ok() || !TakeNewest()) {
      place_ = {pose.state.map_T_imu, pose.covariance, false};
      return Lose("no solution");
    }
    doubts_in_row_ = IsDoubted(map_T_last, motion, seen) ? doubts_in_row_ + 1 : 0;
    if (doubts_in_row_ >= options_.unit.doubt_count_max) return Lose("disagreement");
    tracker_.Drop(window_.dropped_features());
    for (const int64_t id : window_.dropped_features()) features.erase(id);
    last_features_ = std::move(features);
    keyframe_R_now_ = Quaterniond::Identity();
    ForgetSamples(frame.time_ns);
    return std::vector<PlacedState>{NewestPose()};
  }

  void DropOutliers() {
    tracker_.Drop(MonoOutliers(camera_, last_features_, FeaturesOf(tracker_),
                               CameraTurn(keyframe_R_now_), options_.method,
                               options_.frontend.relative_pose));
  }

  StereoMotion MotionTo(const SeenFeatures& features, OdometryMethod method) const {
    return StereoMotionOf(camera_, last_features_, features, CameraTurn(keyframe_R_now_), method,
                          options_.frontend.relative_pose);
  }

  // A distance that disagrees is not believed; the place in the image was checked before.
  void CheckDistances(const StereoMotion& by_three_points, SeenFeatures* features) const {
    const StereoMotion motion = options_.method == OdometryMethod::kFivePoint
                                    ? by_three_points
                                    : MotionTo(*features, options_.method);
    for (const int64_t id : motion.outliers) (*features)[id].disparity_px.reset();
  }

  bool HasFault(ImuFaultKind kind, std::span<const ImuMeasurement> samples) const {
    const std::vector<ImuFault> faults = FaultsOfSamples(samples, imu_.name, options_.inertial);
    return std::any_of(faults.begin(), faults.end(),
                       [kind](const ImuFault& fault) { return fault.kind == kind; });
  }

  std::span<const ImuMeasurement> SamplesSince(TimeNs time_ns) const {
    const auto first = std::find_if(samples_.begin(), samples_.end(),
                                    [&](const auto& sample) { return sample.time_ns > time_ns; });
    return {first, samples_.end()};
  }

  // Where most of what is seen moves otherwise than the path, either the unit is wrong or something
  // fills the image that moves. Nobody can tell which at once: the path goes on, and its covariance
  // says so.
  bool IsDoubted(const Pose3d& map_T_last, const StereoMotion& seen, const SeenFeatures& features) {
    const OdometryUnitOptions& unit = options_.unit;
    if (seen.outcome != PoseOutcome::kFound || seen.inlier_share < unit.doubt_share_min) {
      return false;
    }
    const Pose3d map_T_now = window_.newest().map_T_imu;
    const Pose3d told = (map_T_last * imu_T_camera_).Inverse() * map_T_now * imu_T_camera_;
    const double way_m = (seen.last_T_now.position - told.position).norm();
    const double turn_rad = AngleBetween(seen.last_T_now.orientation, told.orientation);
    if (way_m < unit.doubt_way_m && turn_rad < unit.doubt_turn_rad) return false;
    const double path_share =
        AgreeingShare(camera_, last_features_, features, told, options_.frontend.relative_pose);
    if (path_share > unit.doubt_path_share_max) return false;
    doubt_.Add(map_T_now.position, way_m, turn_rad);
    ++counts_.doubts;
    return true;
  }

  // False when nobody can tell how sure it is.
  bool TakeNewest() {
    ++counts_.keyframes;
    counts_.image_late_s = window_.calibration_error()[2];
    const absl::StatusOr<Matrix15d> covariance = window_.NewestCovariance();
    if (!covariance.ok()) return false;
    // Where measurements miss by more than their noise, the states do, too.
    newest_covariance_ = std::max(1.0, window_.misfit()) * *covariance;
    bias_ = window_.newest().bias;
    place_ = {window_.newest().map_T_imu, newest_covariance_, false};
    return true;
  }

  // As the unit leads on from the newest keyframe.
  PlacedState PoseAfter(const Preintegration& measured) const {
    PlacedState pose;
    pose.time_ns = measured.to_ns();
    pose.covariance = newest_covariance_;
    pose.state =
        measured.Predict(window_.newest(), options_.inertial.gravity_map(), &pose.covariance);
    return pose;
  }

  PlacedState NewestPose() const {
    return {window_.newest_ns(), window_.newest(), newest_covariance_, /*is_keyframe=*/true};
  }

  std::vector<PlacedState> Lose(const std::string& reason) {
    ++counts_.losses[reason];
    doubts_in_row_ = 0;
    is_started_ = false;
    lost_ns_ = last_ns_;
    start_.Clear();
    keyframe_R_now_ = Quaterniond::Identity();
    return {};
  }

  // What was measured since the last keyframe is not believed.
  std::vector<PlacedState> LoseSinceKeyframe(const std::string& reason, TimeNs time_ns) {
    std::vector<PlacedState> none = Lose(reason);
    lost_ns_ = window_.newest_ns();
    GoOnLost(time_ns, Quaterniond::Identity(), /*is_turn_known=*/false);
    return none;
  }

  // Those that no keyframe needs any more.
  void ForgetSamples(TimeNs time_ns) {
    TimeNs from_ns = time_ns - options_.inertial.rest_ns;
    if (!start_.empty()) from_ns = std::min(from_ns, start_.first_ns());
    from_ns -= options_.inertial.gap_ns_max;
    const auto first = std::find_if(samples_.begin(), samples_.end(),
                                    [&](const auto& sample) { return sample.time_ns >= from_ns; });
    samples_.erase(samples_.begin(), first);
  }

  const StereoCamera camera_;
  const ImuCalibration imu_;
  const OdometryOptions options_;
  const Pose3d imu_T_camera_;
  FeatureTracker tracker_;
  SlidingWindow window_;
  OdometryStart start_;
  std::vector<ImuMeasurement> samples_;
  ImuBias bias_;
  bool is_started_ = false;
  // Whether the unit's values vary while it rests.
  bool has_noise_ = true;
  // Whether the samples told the turn since the last image.
  bool has_turn_ = true;
  std::optional<TimeNs> last_ns_;
  std::optional<TimeNs> lost_ns_;
  TimeNs last_seen_ns_ = 0;
  // Where the next start is.
  StartPlace place_;
  // Images since the first keyframe that waits for a start.
  std::vector<TimeNs> early_ns_;
  // Of the unit, since the last keyframe.
  Quaterniond keyframe_R_now_ = Quaterniond::Identity();
  SeenFeatures last_features_;
  Matrix15d newest_covariance_ = Matrix15d::Zero();
  PathDoubt doubt_;
  int doubts_in_row_ = 0;
  OdometryCounts counts_;
};

absl::StatusOr<VisualInertialOdometry> VisualInertialOdometry::Make(
    const StereoCamera& camera, const ImuCalibration& imu, const OdometryOptions& options) {
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  DSG_RETURN_IF_ERROR(camera.left.Validate());
  DSG_RETURN_IF_ERROR(imu.Validate());
  DSG_ASSIGN_OR_RETURN(FeatureTracker tracker,
                       FeatureTracker::Make(camera.left, options.frontend.tracker));
  return VisualInertialOdometry(std::make_unique<Impl>(camera, imu, options, std::move(tracker)));
}

VisualInertialOdometry::VisualInertialOdometry(std::unique_ptr<Impl> impl)
    : impl_(std::move(impl)) {}
VisualInertialOdometry::~VisualInertialOdometry() = default;
VisualInertialOdometry::VisualInertialOdometry(VisualInertialOdometry&&) noexcept = default;
VisualInertialOdometry& VisualInertialOdometry::operator=(VisualInertialOdometry&&) noexcept =
    default;

bool VisualInertialOdometry::AddSample(const ImuMeasurement& sample) {
  return impl_->AddSample(sample);
}
bool VisualInertialOdometry::Covers(TimeNs time_ns) const { return impl_->Covers(time_ns); }
absl::StatusOr<std::vector<OdometryPose>> VisualInertialOdometry::AddFrame(
    const OdometryFrame& frame) {
  return impl_->AddFrame(frame);
}
TimeNs VisualInertialOdometry::waits_from_ns() const { return impl_->waits_from_ns(); }
const std::vector<SeenLandmark>& VisualInertialOdometry::landmarks() const {
  return impl_->landmarks();
}
const OdometryCounts& VisualInertialOdometry::counts() const { return impl_->counts(); }

}  // namespace dsg::ingest
