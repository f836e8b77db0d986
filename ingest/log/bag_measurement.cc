// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_measurement.h"

#include <utility>

#include "ingest/log/body_topology.h"
#include "ingest/log/detection_json.h"
#include "ingest/log/image_file.h"
#include "ingest/log/ros_cloud.h"
#include "ingest/log/ros_image.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"

namespace dsg::ingest {

bool IsImage(TopicUse use) {
  return use == TopicUse::kImage || use == TopicUse::kCompressedImage || use == TopicUse::kCloud;
}

bool IsSensor(TopicUse use) { return use == TopicUse::kImu || IsImage(use); }

ChannelRank RankOf(TopicUse use) {
  switch (use) {
    case TopicUse::kImu:
      return ChannelRank::kImu;
    case TopicUse::kTruth:
    case TopicUse::kExternal:
      return ChannelRank::kPoses;
    case TopicUse::kDetections:
      return ChannelRank::kDetections;
    case TopicUse::kLoops:
      return ChannelRank::kLoops;
    default:
      return ChannelRank::kImages;
  }
}

BagMeasurements::BagMeasurements(std::shared_ptr<const Bag> bag, const BagPlan& plan,
                                 std::string robot_name)
    : bag_(std::move(bag)),
      class_of_color_(std::make_shared<const std::map<uint32_t, int32_t>>(plan.class_of_color)),
      body_topology_(plan.body_topology),
      is_strict_(plan.is_strict),
      robot_name_(std::move(robot_name)) {}

absl::StatusOr<Measurement> BagMeasurements::Read(const BagMessageRef& ref, const BagTopic& topic,
                                                  int64_t number) const {
  const std::string origin = BagOrigin(*bag_, topic.name, number);
  const bool is_image = IsImage(topic.use);
  DSG_ASSIGN_OR_RETURN(const BagMessage message,
                       bag_->Read(ref, is_image ? kImageHeadBytes : SIZE_MAX));
  if (is_image) {
    DSG_ASSIGN_OR_RETURN(const RosHeader header, ParseRosHeader(message.data, origin));
    return Measurement(MakeImage(ref, topic, header.stamp_ns, origin));
  }
  if (topic.use == TopicUse::kImu) {
    DSG_ASSIGN_OR_RETURN(const RosImu imu, ParseRosImu(message.data, origin));
    return Measurement(ImuMeasurement{imu.header.stamp_ns, imu.angular_velocity, imu.acceleration});
  }
  if (topic.use == TopicUse::kDetections) {
    DSG_ASSIGN_OR_RETURN(const std::string_view text, ParseRosString(message.data, origin));
    const LinePosition at{origin, 1};
    DSG_ASSIGN_OR_RETURN(HumanDetection detection, ParseDetection(at, text));
    DSG_RETURN_IF_ERROR(CheckBody(at, body_topology_.get(), is_strict_, detection));
    return Measurement(std::move(detection));
  }
  DSG_ASSIGN_OR_RETURN(const RosPose pose, ParseRosPoseOf(topic.type, message.data, origin));
  DSG_ASSIGN_OR_RETURN(const Pose3d map_T_body, pose.ToPose(origin));
  return MakePose(pose.header.stamp_ns, map_T_body, number);
}

Measurement BagMeasurements::MakePose(TimeNs time_ns, const Pose3d& map_T_body,
                                      int64_t number) const {
  return PoseMeasurement{
      .agent_name = robot_name_,
      .agent_kind = kinds::kRobot,
      .pose = {.time_ns = time_ns, .flags = 0, .map_T_agent = map_T_body, .covariance = nullptr},
      .line = number};
}

ImageMeasurement BagMeasurements::MakeImage(const BagMessageRef& ref, const BagTopic& topic,
                                            TimeNs time_ns, const std::string& origin) const {
  ImageMeasurement image{
      .time_ns = time_ns, .channel = topic.channel, .origin = origin, .load = {}};
  // The bag stays open as long as somebody may ask for the image.
  image.load = [bag = bag_, classes = class_of_color_, ref, decoding = topic.decoding, origin,
                use = topic.use]() -> absl::StatusOr<Image> {
    DSG_ASSIGN_OR_RETURN(const BagMessage message, bag->Read(ref));
    if (use == TopicUse::kCloud) return ParseRosPointCloud(message.data, origin);
    if (use == TopicUse::kCompressedImage) {
      DSG_ASSIGN_OR_RETURN(const RosCompressedImage compressed,
                           ParseRosCompressedImage(message.data, origin));
      return ToImage(compressed, decoding, origin);
    }
    DSG_ASSIGN_OR_RETURN(const RosImage raw, ParseRosImage(message.data, origin));
    return ToImage(raw, decoding, *classes, origin);
  };
  return image;
}

}  // namespace dsg::ingest
