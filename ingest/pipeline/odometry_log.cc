// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/odometry_log.h"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/sensor_log.h"
#include "ingest/odometry/estimator/visual_inertial_odometry.h"
#include "ingest/pipeline/log_eye.h"
#include "ingest/pipeline/map_things.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

// The covariance of the body from that of the unit, which sits elsewhere on it.
Covariance6 BodyCovariance(const OdometryPose& pose, const Pose3d& imu_T_body) {
  const Eigen::Matrix3d map_R_imu = pose.state.map_T_imu.orientation.toRotationMatrix();
  const Eigen::Vector3d lever = map_R_imu * imu_T_body.position;
  Eigen::Matrix<double, 6, 6> by_imu = Eigen::Matrix<double, 6, 6>::Zero();
  by_imu.topLeftCorner<3, 3>().setIdentity();
  by_imu.topRightCorner<3, 3>() = -CrossMatrix(lever) * map_R_imu;
  by_imu.bottomRightCorner<3, 3>() = imu_T_body.orientation.conjugate().toRotationMatrix();
  const Eigen::Matrix<double, 6, 6> whole =
      by_imu * pose.covariance.topLeftCorner<6, 6>() * by_imu.transpose();
  Covariance6 covariance;
  size_t index = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      covariance[index++] = static_cast<float>(whole(row, column));
    }
  }
  return covariance;
}

// A log comes in the order of time. Where samples are missing for longer, none will come, and the
// images must not wait for them in memory.
constexpr TimeNs kWaitNs = 2 * kNsPerSecond;

class OdometryLog : public LogSource {
 public:
  OdometryLog(std::unique_ptr<LogSource> log, LogEye eye, VisualInertialOdometry odometry,
              LogInfo info, std::string robot_name, bool is_masked)
      : log_(std::move(log)),
        eye_(std::move(eye)),
        images_(eye_.left, eye_.other, is_masked),
        odometry_(std::move(odometry)),
        info_(std::move(info)),
        note_count_(log_->info().notes.size()),
        robot_name_(std::move(robot_name)),
        imu_T_body_(info_.rig.imu->body_T_imu.Inverse()) {
    if (is_masked) moving_classes_ = DynamicClasses(info_.labels);
    std::sort(moving_classes_.begin(), moving_classes_.end());
  }

  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    while (true) {
      if (std::optional<Measurement> ready = TakeReady(); ready.has_value()) return ready;
      if (is_ended_) return std::nullopt;
      DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log_->Next());
      if (!measurement.has_value()) {
        is_ended_ = true;
      } else if (!std::holds_alternative<PoseMeasurement>(*measurement)) {
        Note(*measurement);
        held_.push_back(*std::move(measurement));
      }
      DSG_RETURN_IF_ERROR(PlaceFrames());
      if (is_ended_) AddLateNotes();
    }
  }

 private:
  void Note(const Measurement& measurement) {
    images_.Add(measurement);
    if (const auto* sample = std::get_if<ImuMeasurement>(&measurement)) {
      odometry_.AddSample(*sample);
    }
  }

  absl::Status PlaceFrames() {
    while (!images_.empty()) {
      const TimeNs time_ns = images_.front_ns();
      const bool is_awaited = !odometry_.Covers(time_ns) && images_.now_ns() < time_ns + kWaitNs;
      if (!is_ended_ && (images_.IsOpen(time_ns) || is_awaited)) break;
      DSG_RETURN_IF_ERROR(Place(images_.Take()));
    }
    return absl::OkStatus();
  }

  absl::Status Place(const PairedImages& pending) {
    if (!pending.is_whole()) {
      if (pending.left.has_value() || pending.other.has_value()) ++lone_count_;
      return absl::OkStatus();
    }
    if (!odometry_.Covers(pending.time_ns)) {
      ++uncovered_count_;
      return absl::OkStatus();
    }
    const absl::StatusOr<Image> left = pending.left->load();
    absl::StatusOr<OdometryFrame> frame =
        left.ok() ? eye_.eye->FrameOf(pending.time_ns, *left, pending.other->load, MaskOf(pending))
                  : left.status();
    absl::StatusOr<std::vector<OdometryPose>> poses =
        frame.ok() ? odometry_.AddFrame(*frame) : frame.status();
    // What one image does to be refused another one need not: broken files, sizes of their own.
    if (!poses.ok()) {
      ++broken_count_;
      if (first_broken_.empty()) first_broken_ = std::string(poses.status().message());
      return absl::OkStatus();
    }
    for (const OdometryPose& pose : *poses) poses_.push_back(MeasurementOf(pose));
    return absl::OkStatus();
  }

  std::vector<uint8_t> MaskOf(const PairedImages& pending) const {
    if (!pending.label.has_value()) return {};
    const absl::StatusOr<Image> labels = pending.label->load();
    return labels.ok() ? eye_.eye->MaskOf(*labels, moving_classes_) : std::vector<uint8_t>();
  }

  PoseMeasurement MeasurementOf(const OdometryPose& pose) const {
    PoseMeasurement measurement;
    measurement.agent_name = robot_name_;
    measurement.agent_kind = kinds::kRobot;
    measurement.pose.time_ns = pose.time_ns;
    measurement.pose.map_T_agent = pose.state.map_T_imu * imu_T_body_;
    measurement.pose.covariance =
        std::make_shared<const Covariance6>(BodyCovariance(pose, imu_T_body_));
    return measurement;
  }

  // In order: a pose before what has its stamp; nothing of which a pose may still come.
  std::optional<Measurement> TakeReady() {
    const TimeNs held_ns = held_.empty() ? kTimeMax : StampOf(held_.front());
    if (!poses_.empty() && poses_.front().pose.time_ns <= held_ns) {
      Measurement pose = std::move(poses_.front());
      poses_.pop_front();
      return pose;
    }
    if (held_.empty() || (!is_ended_ && held_ns >= FrontierNs())) return std::nullopt;
    Measurement measurement = std::move(held_.front());
    held_.pop_front();
    return measurement;
  }

  TimeNs FrontierNs() const {
    const TimeNs pending_ns = images_.empty() ? kTimeMax : images_.front_ns();
    return std::min(pending_ns, odometry_.waits_from_ns());
  }

  // What only the end of a log tells.
  void AddLateNotes() {
    const std::vector<std::string>& notes = log_->info().notes;
    for (; note_count_ < notes.size(); ++note_count_) info_.notes.push_back(notes[note_count_]);
    const OdometryCounts& counts = odometry_.counts();
    std::string note =
        absl::StrCat("odometry: poses of ", counts.frames - counts.unplaced, " of ", counts.frames,
                     " images, ", counts.keyframes, " keyframes, ", counts.starts_at_rest,
                     " starts at rest and ", counts.starts_in_motion, " in motion");
    for (const auto& [reason, count] : counts.losses) {
      absl::StrAppend(&note, ", lost ", count, " times (", reason, ")");
    }
    const bool has_started = counts.starts_at_rest + counts.starts_in_motion > 0;
    if (!counts.failed_start.empty() && (!has_started || !counts.losses.empty())) {
      absl::StrAppend(&note, "; the last start that failed: ", counts.failed_start);
      if (!counts.gyro_fault.empty()) absl::StrAppend(&note, "; ", counts.gyro_fault);
    }
    info_.notes.push_back(note);
    if (lone_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", lone_count_, " images of ", eye_.left,
                                         " and ", eye_.other,
                                         " have no partner of the same stamp"));
    }
    if (uncovered_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", uncovered_count_,
                                         " images have no inertial samples beside them"));
    }
    if (broken_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", broken_count_,
                                         " images were passed over; the first: ", first_broken_));
    }
  }

  std::unique_ptr<LogSource> log_;
  const LogEye eye_;
  ImagePairing images_;
  VisualInertialOdometry odometry_;
  LogInfo info_;
  /// Of the log's own, those that `info_` has.
  size_t note_count_;
  const std::string robot_name_;
  const Pose3d imu_T_body_;
  std::vector<int32_t> moving_classes_;
  bool is_ended_ = false;
  std::deque<PoseMeasurement> poses_;
  std::deque<Measurement> held_;
  int64_t lone_count_ = 0;
  int64_t uncovered_count_ = 0;
  int64_t broken_count_ = 0;
  std::string first_broken_;
};

}  // namespace

std::string OdometryLogOptions::Digest() const {
  static constexpr const char* kNames[] = {"5pt", "2pt", "dvio"};
  return absl::StrCat("odometry=", kNames[static_cast<size_t>(odometry.method)],
                      is_masked ? " masked" : "", "\n", DigestOptions(odometry));
}

absl::StatusOr<std::unique_ptr<LogSource>> EstimatePoses(std::unique_ptr<LogSource> log,
                                                         const LogOptions& log_options,
                                                         const OdometryLogOptions& options) {
  LogInfo info = log->info();
  if (!info.rig.imu.has_value() || !info.channel_counts.contains("imu0")) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--poses vio: ", info.path,
                                  " has no inertial unit with a calibration; give --poses gt or "
                                  "external, or a --pose-file"),
                     {{"field", "poses"}, {"value", "vio"}});
  }
  DSG_ASSIGN_OR_RETURN(LogEye eye,
                       MakeLogEye(info, options.odometry.frontend.stereo, "--poses vio"));
  DSG_ASSIGN_OR_RETURN(
      VisualInertialOdometry odometry,
      VisualInertialOdometry::Make(eye.eye->camera(), *info.rig.imu, options.odometry));
  const int64_t count = info.channel_counts[eye.left];
  if (info.measurement_count > 0) {
    info.measurement_count += count - info.channel_counts["poses"];
  }
  info.channel_counts["poses"] = count;
  info.used_channels.insert({eye.left, eye.other, "imu0"});
  info.content_sha256 = Sha256Hex(absl::StrCat(info.content_sha256, "\n", options.Digest(), "\n"));
  info.notes.push_back(
      absl::StrCat("the poses are estimated from ", eye.left, ", ", eye.other, " and imu0"));
  return std::make_unique<OdometryLog>(std::move(log), std::move(eye), std::move(odometry),
                                       std::move(info), RobotName(log_options), options.is_masked);
}

}  // namespace dsg::ingest
