// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/visual_odometry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/estimator/keyframe_sights.h"
#include "ingest/odometry/frontend/feature_tracker.h"
#include "ingest/odometry/frontend/point_pose.h"
#include "ingest/odometry/inertial/imu_samples.h"
#include "ingest/odometry/window/sliding_window.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// How sure the origin is of being the origin: a solver wants a covariance.
constexpr double kOriginSigmaM = 1e-3;
constexpr double kOriginSigmaRad = 1e-3;

// Those of the front-end and the window, for images alone and for what measures distances.
OdometryOptions ForImages(OdometryOptions options, const StereoCamera& camera) {
  options.frontend.tracker.level_count = options.visual.level_count;
  // What varies slowly is all that the smallest of these images have.
  options.frontend.tracker.flat_reach_px = 0;
  options.frontend.relative_pose.inlier_px = options.visual.inlier_px;
  options.frontend.relative_pose.consensus.agree_share_min = options.visual.agree_share_min;
  if (!camera.has_depth) return options;
  // Of a depth z, f b / z errs by f b / z^2 times what z does.
  const double sigma_px = camera.left.fx * camera.baseline_m * options.visual.depth_sigma_m;
  options.window.disparity_sigma_px = sigma_px;
  options.window.disparity_offset_px = sigma_px;
  return options;
}

Matrix6d OriginCovariance() {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(kOriginSigmaM * kOriginSigmaM);
  covariance.diagonal().tail<3>().setConstant(kOriginSigmaRad * kOriginSigmaRad);
  return covariance;
}

}  // namespace

Quaterniond LevelAttitude(const StereoCamera& camera) {
  // Columns are the camera's right, down and ahead.
  Eigen::Matrix3d map_R_camera;
  map_R_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return (Quaterniond(map_R_camera) * camera.left.body_T_camera.orientation.conjugate())
      .normalized();
}

class VisualOdometry::Impl {
 public:
  Impl(const StereoCamera& camera, const OdometryOptions& options, FeatureTracker tracker)
      : camera_(camera),
        options_(ForImages(options, camera)),
        model_(StereoModel::Make(camera.left, camera.baseline_m, Pose3d())),
        tracker_(std::move(tracker)),
        window_(model_, options_.inertial.gravity_map(), options_.window) {
    place_.covariance = OriginCovariance();
    StartAt(LevelAttitude(camera));
  }

  void StartAt(const Quaterniond& map_R_body) {
    if (counts_.starts_by_images > 0) return;
    place_.map_T_body.orientation = map_R_body.normalized();
  }

  absl::StatusOr<std::vector<OdometryPose>> AddFrame(const OdometryFrame& frame) {
    if (last_ns_.has_value() && frame.time_ns <= *last_ns_) {
      return BadFrame(frame.time_ns, absl::StrCat("is not after the one at ", *last_ns_, " ns"));
    }
    DSG_RETURN_IF_ERROR(
        tracker_.Track(frame.left, ExpectedTurn(frame.time_ns), frame.mask).status());
    last_ns_ = frame.time_ns;
    ++counts_.frames;
    DSG_ASSIGN_OR_RETURN(std::vector<OdometryPose> poses,
                         is_started_ ? Follow(frame) : Start(frame));
    if (poses.empty()) ++counts_.unplaced;
    for (OdometryPose& pose : poses) pose.covariance *= options_.unit.covariance_factor;
    return poses;
  }

  const std::vector<SeenLandmark>& landmarks() const { return window_.landmarks(); }
  const OdometryCounts& counts() const { return counts_; }

 private:
  // A pose of the body in the odometry frame, and how sure it is; rows as in a pose block's step.
  struct PlacedBody {
    Pose3d map_T_body;
    Matrix6d covariance = Matrix6d::Zero();
  };

  // --- Before a start.

  absl::StatusOr<std::vector<OdometryPose>> Start(const OdometryFrame& frame) {
    DSG_ASSIGN_OR_RETURN(SeenFeatures features, SeeKeyframe(frame, camera_.left, &tracker_));
    const auto known = std::count_if(features.begin(), features.end(), [](const auto& entry) {
      return entry.second.disparity_px.has_value();
    });
    if (known < options_.frontend.relative_pose.consensus.agree_count_min) {
      return std::vector<OdometryPose>();
    }
    const Matrix6d covariance = place_.covariance + LostCovariance(frame.time_ns);
    DSG_RETURN_IF_ERROR(
        window_.BeginByImages(frame.time_ns, place_.map_T_body, covariance, SightsOf(features)));
    is_started_ = true;
    ++counts_.starts_by_images;
    ++counts_.keyframes;
    newest_ = {place_.map_T_body, covariance};
    last_features_ = std::move(features);
    camera_turn_.reset();
    NoteSeen(frame.time_ns, newest_);
    return std::vector<OdometryPose>{
        {frame.time_ns, newest_.map_T_body, newest_.covariance, /*is_keyframe=*/true}};
  }

  // What may have happened since it was seen last.
  Matrix6d LostCovariance(TimeNs time_ns) const {
    Matrix6d covariance = Matrix6d::Zero();
    if (counts_.starts_by_images == 0) return covariance;
    const double seconds = SecondsBetween(last_seen_ns_, time_ns);
    const double way_m = options_.start.lost_speed_m_s * seconds;
    const double turn_rad = std::min(M_PI, options_.start.lost_turn_rad_s * seconds);
    covariance.diagonal().head<3>().setConstant(way_m * way_m);
    covariance.diagonal().tail<3>().setConstant(turn_rad * turn_rad);
    return covariance;
  }

  // --- After it.

  absl::StatusOr<std::vector<OdometryPose>> Follow(const OdometryFrame& frame) {
    std::vector<int64_t> ids;
    std::vector<PointSight> sights;
    LandmarksSeen(&ids, &sights);
    const PointPose seen = PoseOfPoints(sights, camera_.left, ExpectedCamera(frame.time_ns),
                                        options_.frontend.relative_pose);
    if (seen.outcome != PoseOutcome::kFound) return PassOver(frame);
    DropOutliers(ids, seen.inliers);
    const PlacedBody body = BodyOf(seen);
    if (!IsKeyframeDue(frame.time_ns, seen.map_T_camera)) {
      NoteSeen(frame.time_ns, body);
      return std::vector<OdometryPose>{
          {frame.time_ns, body.map_T_body, body.covariance, /*is_keyframe=*/false}};
    }
    DSG_ASSIGN_OR_RETURN(
        SeenFeatures features,
        SeeKeyframe(frame, camera_.left, &tracker_, TurnUntilDepth(frame, body.map_T_body)));
    if (!AddKeyframe(frame.time_ns, body.map_T_body, features)) {
      NoteSeen(frame.time_ns, body);
      return Lose(frame, "no solution");
    }
    tracker_.Drop(window_.dropped_features());
    for (const int64_t id : window_.dropped_features()) features.erase(id);
    last_features_ = std::move(features);
    NoteSeen(frame.time_ns, newest_);
    return std::vector<OdometryPose>{
        {frame.time_ns, newest_.map_T_body, newest_.covariance, /*is_keyframe=*/true}};
  }

  // Features whose place in the map is known: landmarks of the window, or else by what the last
  // keyframe saw.
  void LandmarksSeen(std::vector<int64_t>* ids, std::vector<PointSight>* sights) const {
    const Pose3d map_T_camera = newest_.map_T_body * model_.imu_T_camera;
    for (const Feature& feature : tracker_.features()) {
      std::optional<Vector3d> point = window_.PointOf(feature.id);
      const auto last = last_features_.find(feature.id);
      if (!point.has_value() && last != last_features_.end() &&
          last->second.disparity_px.has_value()) {
        const double inverse_depth =
            InverseDepthOf(model_, window_.calibration_error(), *last->second.disparity_px);
        if (inverse_depth * options_.window.farthest_m < 1.0) continue;
        point = map_T_camera * (model_.RayOf(last->second.pixel) / inverse_depth);
      }
      if (!point.has_value()) continue;
      ids->push_back(feature.id);
      sights->push_back({*point, feature.pixel});
    }
  }

  void DropOutliers(const std::vector<int64_t>& ids, const std::vector<int>& inliers) {
    std::vector<int64_t> outliers;
    size_t next = 0;
    for (size_t i = 0; i < ids.size(); ++i) {
      if (next < inliers.size() && static_cast<size_t>(inliers[next]) == i) {
        ++next;
      } else {
        outliers.push_back(ids[i]);
      }
    }
    tracker_.Drop(outliers);
  }

  // The landmarks are as sure as the newest keyframe is, to which most of them belong.
  PlacedBody BodyOf(const PointPose& seen) const {
    const Pose3d camera_T_body = model_.imu_T_camera.Inverse();
    PlacedBody body;
    body.map_T_body = seen.map_T_camera * camera_T_body;
    body.map_T_body.orientation.normalize();
    body.covariance = CovarianceAt(newest_.covariance, newest_.map_T_body,
                                   newest_.map_T_body.Inverse() * body.map_T_body) +
                      CovarianceAt(seen.covariance, seen.map_T_camera, camera_T_body);
    return body;
  }

  bool IsKeyframeDue(TimeNs time_ns, const Pose3d& map_T_camera) const {
    const TimeNs span_ns = time_ns - window_.newest_ns();
    if (span_ns >= options_.keyframe.period_ns_max) return true;
    const SeenFeatures now = FeaturesOf(tracker_);
    // Nothing leads on where features run out, however soon that is.
    const bool is_losing = static_cast<double>(SharedCount(last_features_, now)) <
                           options_.keyframe.share_min * static_cast<double>(last_features_.size());
    if (is_losing) return true;
    if (span_ns < options_.keyframe.period_ns_min) return false;
    const Pose3d map_T_last = newest_.map_T_body * model_.imu_T_camera;
    const Quaterniond last_R_now =
        (map_T_last.orientation.conjugate() * map_T_camera.orientation).normalized();
    return HasMoved(camera_, last_features_, now, last_R_now, options_.keyframe);
  }

  // False when nobody can tell where it is, or how sure that is.
  bool AddKeyframe(TimeNs time_ns, const Pose3d& guess, const SeenFeatures& features) {
    if (!window_.AddByImages(time_ns, guess, SightsOf(features)).ok()) return false;
    ++counts_.keyframes;
    const absl::StatusOr<Matrix6d> covariance = window_.NewestPoseCovariance();
    if (!covariance.ok()) return false;
    newest_ = {window_.newest().map_T_imu, *covariance};
    return true;
  }

  // --- How it moves.

  // Of the camera, in its frame at the image that the tracker compares the next one with.
  Quaterniond ExpectedTurn(TimeNs time_ns) const {
    const TimeNs span_ns = time_ns - last_seen_ns_;
    if (!camera_turn_.has_value() || span_ns > options_.visual.lead_ns_max) {
      return Quaterniond::Identity();
    }
    return RotationOf(SecondsBetween(last_seen_ns_, time_ns) * *camera_turn_);
  }

  Pose3d ExpectedCamera(TimeNs time_ns) const {
    return place_.map_T_body * model_.imu_T_camera * Pose3d{{0, 0, 0}, ExpectedTurn(time_ns)};
  }

  // Since the last image that told a pose, rad/s in the camera's frame; nullopt if there is none.
  std::optional<Vector3d> CameraTurnTo(TimeNs time_ns, const Pose3d& map_T_body) const {
    const double seconds = SecondsBetween(last_seen_ns_, time_ns);
    if (!has_seen_ || !(seconds > 0.0)) return std::nullopt;
    const Quaterniond& mount = model_.imu_T_camera.orientation;
    const Quaterniond turn = place_.map_T_body.orientation.conjugate() * map_T_body.orientation;
    return RotationVectorOf((mount.conjugate() * turn * mount).normalized()) / seconds;
  }

  // As it has turned up to the image, it goes on until its depth is measured.
  Quaterniond TurnUntilDepth(const OdometryFrame& frame, const Pose3d& map_T_body) const {
    const std::optional<Vector3d> turn = CameraTurnTo(frame.time_ns, map_T_body);
    if (!turn.has_value()) return Quaterniond::Identity();
    // Depth may also be the earlier one.
    return RotationOf(1e-9 * static_cast<double>(frame.depth_late_ns) * *turn);
  }

  void NoteSeen(TimeNs time_ns, const PlacedBody& body) {
    const std::optional<Vector3d> turn = CameraTurnTo(time_ns, body.map_T_body);
    if (turn.has_value()) camera_turn_ = turn;
    has_seen_ = true;
    last_seen_ns_ = time_ns;
    place_ = body;
  }

  // --- When it does not know.

  absl::StatusOr<std::vector<OdometryPose>> PassOver(const OdometryFrame& frame) {
    if (frame.time_ns - last_seen_ns_ > options_.visual.blind_ns_max) return Lose(frame, "blind");
    tracker_.GoBack();
    return std::vector<OdometryPose>();
  }

  // This image may be the next start.
  absl::StatusOr<std::vector<OdometryPose>> Lose(const OdometryFrame& frame,
                                                 const std::string& reason) {
    ++counts_.losses[reason];
    is_started_ = false;
    has_seen_ = false;
    return Start(frame);
  }

  const StereoCamera camera_;
  const OdometryOptions options_;
  const StereoModel model_;
  FeatureTracker tracker_;
  SlidingWindow window_;
  bool is_started_ = false;
  std::optional<TimeNs> last_ns_;
  // Where the last image that told a pose was taken, or where the next start is.
  PlacedBody place_;
  bool has_seen_ = false;
  TimeNs last_seen_ns_ = 0;
  // Between the last two of these, rad/s in the camera's frame.
  std::optional<Vector3d> camera_turn_;
  // Of the newest keyframe.
  PlacedBody newest_;
  SeenFeatures last_features_;
  OdometryCounts counts_;
};

absl::StatusOr<VisualOdometry> VisualOdometry::Make(const StereoCamera& camera,
                                                    const OdometryOptions& options) {
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  DSG_RETURN_IF_ERROR(camera.left.Validate());
  DSG_ASSIGN_OR_RETURN(
      FeatureTracker tracker,
      FeatureTracker::Make(camera.left, ForImages(options, camera).frontend.tracker));
  return VisualOdometry(std::make_unique<Impl>(camera, options, std::move(tracker)));
}

VisualOdometry::VisualOdometry(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VisualOdometry::~VisualOdometry() = default;
VisualOdometry::VisualOdometry(VisualOdometry&&) noexcept = default;
VisualOdometry& VisualOdometry::operator=(VisualOdometry&&) noexcept = default;

void VisualOdometry::StartAt(const Quaterniond& map_R_body) { impl_->StartAt(map_R_body); }
bool VisualOdometry::AddSample(const ImuMeasurement& /*sample*/) { return false; }
bool VisualOdometry::Covers(TimeNs /*time_ns*/) const { return true; }
absl::StatusOr<std::vector<OdometryPose>> VisualOdometry::AddFrame(const OdometryFrame& frame) {
  return impl_->AddFrame(frame);
}
TimeNs VisualOdometry::waits_from_ns() const { return kTimeMax; }
const std::vector<SeenLandmark>& VisualOdometry::landmarks() const { return impl_->landmarks(); }
const OdometryCounts& VisualOdometry::counts() const { return impl_->counts(); }

}  // namespace dsg::ingest
