// SPDX-License-Identifier: Apache-2.0
// One message of a bag as a measurement.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/bag_topics.h"
#include "ingest/log/log_source.h"
#include "ingest/log/sensor_log.h"

namespace dsg::ingest {

/// The head of an image: stamp, frame, size, encoding.
inline constexpr size_t kImageHeadBytes = 4096;

/// Of pixels or points, which are not read before somebody asks for them.
bool IsImage(TopicUse use);
/// Measured by the robot itself: an image, or an inertial sample.
bool IsSensor(TopicUse use);
ChannelRank RankOf(TopicUse use);

/// Threads: any number of callers.
class BagMeasurements {
 public:
  /// `robot_name`: whose poses the bag has.
  BagMeasurements(std::shared_ptr<const Bag> bag, const BagPlan& plan, std::string robot_name);

  /// `number`: of the message in its topic, from 1. An image keeps the bag open.
  /// Requires: the topic is used, and not for loop closures.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming topic and message.
  absl::StatusOr<Measurement> Read(const BagMessageRef& ref, const BagTopic& topic,
                                   int64_t number) const;
  Measurement MakePose(TimeNs time_ns, const Pose3d& map_T_body, int64_t number) const;

 private:
  ImageMeasurement MakeImage(const BagMessageRef& ref, const BagTopic& topic, TimeNs time_ns,
                             const std::string& origin) const;

  std::shared_ptr<const Bag> bag_;
  std::shared_ptr<const std::map<uint32_t, int32_t>> class_of_color_;
  std::shared_ptr<const Topology> body_topology_;
  bool is_strict_;
  std::string robot_name_;
};

}  // namespace dsg::ingest
