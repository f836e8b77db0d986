// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/odometry_log.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/sensor_log.h"
#include "ingest/odometry/estimator/odometry.h"
#include "ingest/odometry/estimator/visual_inertial_odometry.h"
#include "ingest/odometry/estimator/visual_odometry.h"
#include "ingest/pipeline/log_eye.h"
#include "ingest/pipeline/map_things.h"
#include "ingest/sensor/depth_frame.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

Covariance6 PackedCovariance(const Matrix6d& whole) {
  Covariance6 covariance;
  size_t index = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      covariance[index++] = static_cast<float>(whole(row, column));
    }
  }
  return covariance;
}

std::string StartsText(const OdometryCounts& counts) {
  if (counts.starts_by_images > 0) return absl::StrCat(counts.starts_by_images, " starts");
  return absl::StrCat(counts.starts_at_rest, " starts at rest and ", counts.starts_in_motion,
                      " in motion");
}

// The direction that points up, told by the depth of an image, if the body has the attitude
// `map_R_body`; nullopt when in doubt.
std::optional<Eigen::Vector3d> UpIn(const OdometryFrame& frame, const StereoCamera& camera,
                                    const Eigen::Quaterniond& map_R_body,
                                    const GravityOptions& options) {
  std::vector<Eigen::Vector2d> pixels;
  for (int v = 0; v < camera.left.height; ++v) {
    for (int u = 0; u < camera.left.width; ++u) pixels.emplace_back(u, v);
  }
  const auto disparities = frame.disparities(frame.left, pixels);
  if (!disparities.ok()) return std::nullopt;
  DepthFrame depth;
  depth.time_ns = frame.time_ns;
  depth.camera = camera.left;
  depth.map_T_camera.orientation = map_R_body * camera.left.body_T_camera.orientation;
  for (const std::optional<double>& disparity_px : *disparities) {
    const double scale = camera.left.fx * camera.baseline_m;
    depth.depth_m.push_back(disparity_px.has_value() ? static_cast<float>(scale / *disparity_px)
                                                     : 0.0f);
  }
  return EstimateUp({std::move(depth)}, options);
}

// A log comes in the order of time. Where samples are missing for longer, none will come, and the
// images must not wait for them in memory.
constexpr TimeNs kWaitNs = 2 * kNsPerSecond;

// Clocks that are off by less are as good as they get.
constexpr double kTellLateS = 0.005;

class OdometryLog : public LogSource {
 public:
  OdometryLog(std::unique_ptr<LogSource> log, LogEye eye, std::unique_ptr<Odometry> odometry,
              LogInfo info, std::string robot_name, const OdometryLogOptions& options,
              std::optional<OdometryMesh> mesh)
      : log_(std::move(log)),
        eye_(std::move(eye)),
        images_(eye_.left, eye_.other, options.is_masked,
                eye_.is_pair ? 0 : options.odometry.visual.apart_ns_max),
        odometry_(std::move(odometry)),
        info_(std::move(info)),
        note_count_(log_->info().notes.size()),
        robot_name_(std::move(robot_name)),
        mesh_(std::move(mesh)),
        gravity_(options.gravity),
        has_unit_(info_.used_channels.contains("imu0")),
        needs_up_(!has_unit_) {
    if (options.is_masked) moving_classes_ = DynamicClasses(info_.labels);
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
      if (!is_ended_) continue;
      AddLateNotes();
      DSG_RETURN_IF_ERROR(EndMesh());
    }
  }

 private:
  void Note(const Measurement& measurement) {
    images_.Add(measurement);
    if (const auto* sample = std::get_if<ImuMeasurement>(&measurement)) {
      if (!odometry_->AddSample(*sample) && has_unit_) ++bad_sample_count_;
    }
  }

  absl::Status PlaceFrames() {
    while (!images_.empty()) {
      const TimeNs time_ns = images_.front_ns();
      const bool is_awaited = !odometry_->Covers(time_ns) && images_.now_ns() < time_ns + kWaitNs;
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
    if (!odometry_->Covers(pending.time_ns)) {
      ++uncovered_count_;
      return absl::OkStatus();
    }
    const absl::StatusOr<Image> left = pending.left->load();
    absl::StatusOr<OdometryFrame> frame =
        left.ok() ? eye_.eye->FrameOf(pending.time_ns, *left, pending.other->load, MaskOf(pending))
                  : left.status();
    if (frame.ok()) frame->depth_late_ns = pending.other->time_ns - pending.time_ns;
    if (frame.ok() && needs_up_) StartUpright(*frame);
    absl::StatusOr<std::vector<OdometryPose>> poses =
        frame.ok() ? odometry_->AddFrame(*frame) : frame.status();
    needs_up_ = needs_up_ && odometry_->counts().starts_by_images == 0;
    // What one image does to be refused another one need not: broken files, sizes of their own.
    if (!poses.ok()) {
      ++broken_count_;
      if (first_broken_.empty()) first_broken_ = std::string(poses.status().message());
      return absl::OkStatus();
    }
    for (const OdometryPose& pose : *poses) poses_.push_back(MeasurementOf(pose));
    if (mesh_.has_value() && !poses->empty() && poses->back().is_keyframe) {
      mesh_->Add(pending.time_ns, poses_.back().pose.map_T_agent, odometry_->landmarks(),
                 frame->mask);
    }
    return absl::OkStatus();
  }

  // A stereo pair would have to be matched at each pixel for it.
  void StartUpright(const OdometryFrame& frame) {
    const StereoCamera& camera = eye_.eye->camera();
    const Eigen::Quaterniond level = LevelAttitude(camera);
    const std::optional<Eigen::Vector3d> up_level =
        camera.has_depth ? UpIn(frame, camera, level, gravity_) : std::nullopt;
    if (up_level.has_value()) {
      const auto upright = Eigen::Quaterniond::FromTwoVectors(*up_level, Eigen::Vector3d::UnitZ());
      odometry_->StartAt(upright * level);
    }
    up_note_ = up_level.has_value()
                   ? "odometry: up is what the first depth image shows"
                   : "odometry: the first image does not show what is up: the camera is taken for "
                     "level there; --up says another direction";
  }

  absl::Status EndMesh() {
    if (!mesh_.has_value()) return absl::OkStatus();
    info_.notes.push_back(mesh_->Note());
    return mesh_->Write();
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
    measurement.pose.map_T_agent = pose.map_T_body;
    measurement.pose.covariance =
        std::make_shared<const Covariance6>(PackedCovariance(pose.covariance));
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
    return std::min(pending_ns, odometry_->waits_from_ns());
  }

  // What only the end of a log tells.
  void AddLateNotes() {
    const std::vector<std::string>& notes = log_->info().notes;
    for (; note_count_ < notes.size(); ++note_count_) info_.notes.push_back(notes[note_count_]);
    const OdometryCounts& counts = odometry_->counts();
    std::string note =
        absl::StrCat("odometry: poses of ", counts.frames - counts.unplaced, " of ", counts.frames,
                     " images, ", counts.keyframes, " keyframes, ", StartsText(counts));
    for (const auto& [reason, count] : counts.losses) {
      absl::StrAppend(&note, ", lost ", count, " times (", reason, ")");
    }
    const bool has_started = counts.starts_at_rest + counts.starts_in_motion > 0;
    if (!counts.failed_start.empty() && (!has_started || !counts.losses.empty())) {
      absl::StrAppend(&note, "; the last start that failed: ", counts.failed_start);
      if (!counts.gyro_fault.empty()) absl::StrAppend(&note, "; ", counts.gyro_fault);
    }
    info_.notes.push_back(note);
    if (counts.doubts > 0) {
      info_.notes.push_back(absl::StrCat(
          "odometry: at ", counts.doubts, " keyframes most of what was seen moved otherwise than ",
          "the inertial unit tells: it is wrong there (look at its samples), or people fill the ",
          "image (--odometry-masks); covariances are larger since"));
    }
    if (std::abs(counts.image_late_s) >= kTellLateS) {
      info_.notes.push_back(absl::StrFormat(
          "odometry: images were taken %.0f ms %s their stamps on the clock of the inertial unit; "
          "poses know of it, and are those of the stamps on that clock",
          1e3 * std::abs(counts.image_late_s), counts.image_late_s > 0.0 ? "after" : "before"));
    }
    if (!up_note_.empty()) info_.notes.push_back(up_note_);
    if (lone_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", lone_count_, " images of ", eye_.left,
                                         " and ", eye_.other, " have no partner of the same stamp",
                                         eye_.is_pair ? "" : " or near it"));
    }
    if (uncovered_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", uncovered_count_,
                                         " images have no inertial samples beside them"));
    }
    if (bad_sample_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", bad_sample_count_,
                                         " inertial samples were left out: no numbers, higher than "
                                         "any unit measures (--inertial-rate-most, "
                                         "--inertial-force-most), or out of order; look at the "
                                         "unit's driver"));
    }
    if (broken_count_ > 0) {
      info_.notes.push_back(absl::StrCat("odometry: ", broken_count_,
                                         " images were passed over; the first: ", first_broken_));
    }
  }

  std::unique_ptr<LogSource> log_;
  const LogEye eye_;
  ImagePairing images_;
  std::unique_ptr<Odometry> odometry_;
  LogInfo info_;
  /// Of the log's own, those that `info_` has.
  size_t note_count_;
  const std::string robot_name_;
  std::optional<OdometryMesh> mesh_;
  const GravityOptions gravity_;
  const bool has_unit_;
  // The odometry has not started yet, and nothing else tells what is up.
  bool needs_up_;
  std::string up_note_;
  std::vector<int32_t> moving_classes_;
  bool is_ended_ = false;
  std::deque<PoseMeasurement> poses_;
  std::deque<Measurement> held_;
  int64_t lone_count_ = 0;
  int64_t uncovered_count_ = 0;
  int64_t broken_count_ = 0;
  int64_t bad_sample_count_ = 0;
  std::string first_broken_;
};

// What the calibration says nothing of is that of a consumer unit.
void FillNoise(const OdometryUnitOptions& usual, ImuCalibration* imu,
               std::vector<std::string>* notes) {
  bool is_filled = false;
  const auto fill = [&](double* value, double usual_value) {
    if (*value != 0.0) return;
    *value = usual_value;
    is_filled = true;
  };
  fill(&imu->gyro_noise_density, usual.gyro_noise_density);
  fill(&imu->gyro_random_walk, usual.gyro_random_walk);
  fill(&imu->accel_noise_density, usual.accel_noise_density);
  fill(&imu->accel_random_walk, usual.accel_random_walk);
  if (!is_filled) return;
  notes->push_back(absl::StrCat(
      "odometry: the log does not tell all noise of ", imu->name,
      ": taken for a consumer unit's; give --odometry-unit-gyro, -gyro-walk, -accel and "
      "-accel-walk if you know better"));
}

// With an inertial unit if the log has one, and says in `info` what it uses.
absl::StatusOr<std::unique_ptr<Odometry>> MakeOdometry(const LogEye& eye,
                                                       const OdometryLogOptions& options,
                                                       LogInfo* info) {
  info->used_channels.insert({eye.left, eye.other});
  const bool has_samples = info->channel_counts.contains("imu0");
  if (options.is_inertial && has_samples && info->rig.imu.has_value()) {
    info->used_channels.insert("imu0");
    ImuCalibration imu = *info->rig.imu;
    FillNoise(options.odometry.unit, &imu, &info->notes);
    info->notes.push_back(
        absl::StrCat("the poses are estimated from ", eye.left, ", ", eye.other, " and imu0"));
    DSG_ASSIGN_OR_RETURN(VisualInertialOdometry odometry,
                         VisualInertialOdometry::Make(eye.eye->camera(), imu, options.odometry));
    return std::make_unique<VisualInertialOdometry>(std::move(odometry));
  }
  if (options.is_inertial && has_samples) {
    info->notes.push_back("odometry: imu0 has no calibration and is not used");
  }
  info->notes.push_back(
      absl::StrCat("the poses are estimated from ", eye.left, " and ", eye.other, " alone"));
  DSG_ASSIGN_OR_RETURN(VisualOdometry odometry,
                       VisualOdometry::Make(eye.eye->camera(), options.odometry));
  return std::make_unique<VisualOdometry>(std::move(odometry));
}

}  // namespace

std::string OdometryLogOptions::Digest() const {
  static constexpr const char* kNames[] = {"5pt", "2pt", "dvio"};
  return absl::StrCat("odometry=", kNames[static_cast<size_t>(odometry.method)],
                      is_masked ? " masked" : "", is_inertial ? "" : " by images", "\n",
                      DigestOptions(odometry), DigestOptions(gravity));
}

absl::StatusOr<std::unique_ptr<LogSource>> EstimatePoses(std::unique_ptr<LogSource> log,
                                                         const LogOptions& log_options,
                                                         const OdometryLogOptions& options) {
  LogInfo info = log->info();
  DSG_ASSIGN_OR_RETURN(LogEye eye,
                       MakeLogEye(info, options.odometry.frontend.stereo, "--poses vio"));
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<Odometry> odometry, MakeOdometry(eye, options, &info));
  std::optional<OdometryMesh> mesh;
  if (options.mesh.has_value()) {
    DSG_ASSIGN_OR_RETURN(mesh, OdometryMesh::Make(eye.eye->camera().left, *options.mesh));
  }
  const int64_t count = info.channel_counts[eye.left];
  if (info.measurement_count > 0) {
    info.measurement_count += count - info.channel_counts["poses"];
  }
  info.channel_counts["poses"] = count;
  info.content_sha256 = Sha256Hex(absl::StrCat(info.content_sha256, "\n", options.Digest(), "\n"));
  return std::make_unique<OdometryLog>(std::move(log), std::move(eye), std::move(odometry),
                                       std::move(info), RobotName(log_options), options,
                                       std::move(mesh));
}

}  // namespace dsg::ingest
