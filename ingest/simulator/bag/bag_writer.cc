// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/bag/bag_writer.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "ingest/log/loop_file.h"
#include "ingest/simulator/bag/bag_messages.h"
#include "ingest/simulator/bag/bag_output_internal.h"
#include "ingest/simulator/bag/folder_text.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "schema/model/node.h"

namespace dsg::simulator {
namespace {

constexpr char kImuTopic[] = "/tesse/imu/noisy/imu";
constexpr char kOdometryTopic[] = "/tesse/odom";
constexpr char kSegmentationTopic[] = "/tesse/seg_cam/rgb/image_raw";
constexpr char kDetectionsTopic[] = "/dsg/detections";
constexpr char kLoopsTopic[] = "/dsg/loop_closures";
constexpr char kLabelsTopic[] = "/dsg/labels";
constexpr char kBodyTopologyTopic[] = "/dsg/body_topology";
constexpr char kTransformsTopic[] = "/tf_static";
// Calibrations that should be equal are read from text and were made orthonormal.
constexpr double kSameCalibration = 1e-9;

struct ImageTopic {
  const char* channel;
  const char* topic;
  const char* frame;
  /// Null: no calibration of its own in the bag, that of the left camera holds.
  const char* info_topic;
};
constexpr ImageTopic kImageTopics[] = {
    {"cam0", "/tesse/left_cam/mono/image_raw", kLeftFrame, "/tesse/left_cam/camera_info"},
    {"cam1", "/tesse/right_cam/mono/image_raw", kRightFrame, "/tesse/right_cam/camera_info"},
    {"color0", "/tesse/left_cam/rgb/image_raw", kLeftFrame, nullptr},
    {"depth0", "/tesse/depth_cam/mono/image_raw", kLeftFrame, nullptr},
    {"label0", "/dsg/label/image_raw", kLeftFrame, nullptr},
};

absl::Status Unfit(const std::string& file, const std::string& message) {
  return MakeError(Reason::kFileMalformed, absl::StrCat(file, ": ", message), {{"file", file}});
}

bool FitsChannel(std::string_view channel, ingest::PixelFormat format) {
  if (channel == "color0") return format == ingest::PixelFormat::kRgb8;
  if (channel == "label0") return format == ingest::PixelFormat::kLabel16;
  if (channel == "depth0") {
    return format == ingest::PixelFormat::kDepth16 || format == ingest::PixelFormat::kDepth32;
  }
  return format == ingest::PixelFormat::kGray8;
}

bool SameView(const ingest::CameraCalibration& a, const ingest::CameraCalibration& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
         a.distortion_coefficients == b.distortion_coefficients &&
         a.body_T_camera.position.isApprox(b.body_T_camera.position, kSameCalibration) &&
         a.body_T_camera.orientation.isApprox(b.body_T_camera.orientation, kSameCalibration);
}

// A bag has one calibration for the left camera and none for the inertial unit.
absl::Status CheckRig(const ingest::LogInfo& info) {
  const ingest::CameraCalibration* left = info.rig.FindCamera("cam0");
  for (const ImageTopic& image : kImageTopics) {
    const ingest::CameraCalibration* camera = info.rig.FindCamera(image.channel);
    if (image.info_topic != nullptr || camera == nullptr || left == nullptr) continue;
    if (!SameView(*left, *camera)) {
      return Unfit(info.path, absl::StrCat(image.channel,
                                           " is not calibrated as cam0 is; a bag has "
                                           "one calibration for both"));
    }
  }
  if (!info.rig.imu.has_value()) return absl::OkStatus();
  const Pose3d& body_T_imu = info.rig.imu->body_T_imu;
  if (body_T_imu.position.norm() > kSameCalibration ||
      AngleBetween(body_T_imu.orientation, Eigen::Quaterniond::Identity()) > kSameCalibration) {
    return Unfit(info.path, "imu0 is not in the body's frame; a bag has no place for its T_BS");
  }
  return absl::OkStatus();
}

class Converter {
 public:
  Converter(const ingest::LogInfo& info, FolderText text, BagOutput* bag)
      : rig_(info.rig), text_(std::move(text)), bag_(bag) {}

  absl::Status Add(const ingest::Measurement& measurement) {
    return std::visit([this](const auto& m) { return AddOne(m); }, measurement);
  }
  // The rest of the detections.
  absl::Status Finish() { return WriteDetections(kTimeMax); }

 private:
  absl::Status AddOne(const ingest::ImuMeasurement& imu) {
    DSG_ASSIGN_OR_RETURN(const ros::Time stamp, Advance(imu.time_ns));
    return WriteStamped(kImuTopic, stamp, ToImu(imu));
  }
  absl::Status AddOne(const ingest::ImageMeasurement& image);
  absl::Status AddOne(const ingest::PoseMeasurement& pose);
  absl::Status AddOne(const ingest::HumanDetection& detection) {
    // Its line is written as it stands in the file.
    return Advance(detection.time_ns).status();
  }
  absl::Status AddOne(const ingest::LoopMeasurement& loop) {
    DSG_ASSIGN_OR_RETURN(const ros::Time stamp, Advance(loop.time_ns));
    ros_messages::String message;
    message.data = ingest::FormatLoop(loop);
    return bag_->Write(kLoopsTopic, stamp, message);
  }
  absl::Status AddOne(const ingest::GraphMeasurement&) {
    return absl::InvalidArgumentError("a bag of sensors cannot hold a scene graph");
  }

  // What is due before a measurement of this time.
  absl::StatusOr<ros::Time> Advance(TimeNs time_ns);
  absl::Status WriteLatched(const ros::Time& stamp);
  absl::Status WriteDetections(TimeNs before_ns);
  absl::Status WriteInfo(const ImageTopic& topic, const ros::Time& stamp);

  template <class Message>
  absl::Status WriteStamped(const char* topic, const ros::Time& stamp, Message message) {
    message.header.stamp = stamp;
    message.header.seq = message_counts_[topic]++;
    return bag_->Write(topic, stamp, message);
  }

  const ingest::RigCalibration& rig_;
  FolderText text_;
  BagOutput* bag_;
  std::map<std::string, uint32_t> message_counts_;
  std::optional<TimeNs> last_ns_;
};

absl::StatusOr<ros::Time> Converter::Advance(TimeNs time_ns) {
  DSG_ASSIGN_OR_RETURN(const ros::Time stamp, ToRosTime(time_ns));
  if (!last_ns_.has_value()) DSG_RETURN_IF_ERROR(WriteLatched(stamp));
  DSG_CHECK(!last_ns_.has_value() || *last_ns_ <= time_ns);
  last_ns_ = time_ns;
  DSG_RETURN_IF_ERROR(WriteDetections(time_ns));
  return stamp;
}

absl::Status Converter::WriteLatched(const ros::Time& stamp) {
  ros_messages::TfMessage transforms;
  for (const auto& [channel, frame] : {std::pair{"cam0", kLeftFrame}, {"cam1", kRightFrame}}) {
    const ingest::CameraCalibration* camera = rig_.FindCamera(channel);
    if (camera == nullptr) continue;
    transforms.transforms.push_back(ToTransform(camera->body_T_camera, frame));
    transforms.transforms.back().header.stamp = stamp;
  }
  DSG_RETURN_IF_ERROR(bag_->WriteLatched(kTransformsTopic, stamp, transforms));
  for (const auto& [topic, text] :
       {std::pair{kLabelsTopic, &text_.labels}, {kBodyTopologyTopic, &text_.body_topology}}) {
    if (!text->has_value()) continue;
    ros_messages::String message;
    message.data = **text;
    DSG_RETURN_IF_ERROR(bag_->WriteLatched(topic, stamp, message));
  }
  return absl::OkStatus();
}

absl::Status Converter::WriteDetections(TimeNs before_ns) {
  DetectionLines& lines = *text_.detections;
  while (!lines.at_end() && lines.time_ns() < before_ns) {
    DSG_ASSIGN_OR_RETURN(const ros::Time stamp, ToRosTime(lines.time_ns()));
    ros_messages::String message;
    message.data = lines.text();
    DSG_RETURN_IF_ERROR(bag_->Write(kDetectionsTopic, stamp, message));
    DSG_RETURN_IF_ERROR(lines.Advance());
  }
  return absl::OkStatus();
}

absl::Status Converter::AddOne(const ingest::PoseMeasurement& pose) {
  if (pose.agent_kind != kinds::kRobot) {
    return Unfit(pose.agent_name, "is not a robot; a bag of sensors holds one robot's poses");
  }
  DSG_ASSIGN_OR_RETURN(const ros::Time stamp, Advance(pose.pose.time_ns));
  return WriteStamped(kOdometryTopic, stamp, ToOdometry(pose.pose.map_T_agent));
}

absl::Status Converter::AddOne(const ingest::ImageMeasurement& measurement) {
  const auto* topic = std::find_if(std::begin(kImageTopics), std::end(kImageTopics),
                                   [&](const auto& t) { return measurement.channel == t.channel; });
  if (topic == std::end(kImageTopics)) {
    return Unfit(measurement.origin, absl::StrCat("no topic for channel ", measurement.channel));
  }
  DSG_ASSIGN_OR_RETURN(const ros::Time stamp, Advance(measurement.time_ns));
  DSG_ASSIGN_OR_RETURN(const ingest::Image image, measurement.load());
  if (!FitsChannel(measurement.channel, image.format)) {
    return Unfit(measurement.origin, absl::StrCat(std::string(ingest::Name(image.format)),
                                                  " is no image for ", measurement.channel));
  }
  ros_messages::Image message = ToImage(image);
  message.header.frame_id = topic->frame;
  DSG_RETURN_IF_ERROR(WriteStamped(topic->topic, stamp, std::move(message)));
  if (topic->info_topic != nullptr) return WriteInfo(*topic, stamp);
  if (image.format != ingest::PixelFormat::kLabel16) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const ingest::Image colored,
                       ColorLabels(image, text_.colors, measurement.origin));
  message = ToImage(colored);
  message.header.frame_id = topic->frame;
  return WriteStamped(kSegmentationTopic, stamp, std::move(message));
}

absl::Status Converter::WriteInfo(const ImageTopic& topic, const ros::Time& stamp) {
  const ingest::CameraCalibration* camera = rig_.FindCamera(topic.channel);
  if (camera == nullptr) return absl::OkStatus();
  const ingest::CameraCalibration* left = rig_.FindCamera("cam0");
  const double baseline_m =
      left == nullptr ? 0.0 : (left->body_T_camera.Inverse() * camera->body_T_camera).position.x();
  ros_messages::CameraInfo info = ToCameraInfo(*camera, baseline_m);
  info.header.frame_id = topic.frame;
  return WriteStamped(topic.info_topic, stamp, std::move(info));
}

// Tells whole percents only: a callback may draw.
class PercentTeller {
 public:
  PercentTeller(const std::function<void(double)>& progress, int64_t total)
      : progress_(progress), total_(total) {}
  void Tell(int64_t done) {
    const int64_t percent = total_ > 0 ? done * 100 / total_ : 0;
    if (!progress_ || percent == told_ || percent > 100) return;
    told_ = percent;
    progress_(static_cast<double>(percent) / 100.0);
  }

 private:
  const std::function<void(double)>& progress_;
  int64_t total_;
  int64_t told_ = -1;
};

}  // namespace

absl::Status WriteBag(ingest::LogSource* log, const std::string& log_folder,
                      const std::string& bag_path, const BagOptions& options) {
  DSG_RETURN_IF_ERROR(CheckRig(log->info()));
  DSG_ASSIGN_OR_RETURN(FolderText text, ReadFolderText(log_folder, log->info()));
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<BagOutput> bag,
                       BagOutput::Create(bag_path, options.compression));
  Converter converter(log->info(), std::move(text), bag.get());
  PercentTeller teller(options.progress, log->info().measurement_count);
  for (int64_t done = 0;; ++done) {
    teller.Tell(done);
    DSG_ASSIGN_OR_RETURN(const std::optional<ingest::Measurement> measurement, log->Next());
    if (!measurement.has_value()) break;
    DSG_RETURN_IF_ERROR(converter.Add(*measurement));
  }
  DSG_RETURN_IF_ERROR(converter.Finish());
  DSG_RETURN_IF_ERROR(bag->Commit());
  if (options.progress) options.progress(1.0);
  return absl::OkStatus();
}

absl::Status WriteBag(const std::string& log_folder, const std::string& bag_path,
                      const BagOptions& options) {
  ingest::LogOptions log_options;
  log_options.poses = ingest::PoseSource::kGroundTruth;
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<ingest::LogSource> log,
                       ingest::OpenLog(log_folder, log_options));
  return WriteBag(log.get(), log_folder, bag_path, options);
}

absl::Status WriteBag(const std::string& log_folder, const std::string& bag_path,
                      const std::function<void(double)>& progress) {
  return WriteBag(log_folder, bag_path, BagOptions{.progress = progress});
}

}  // namespace dsg::simulator
