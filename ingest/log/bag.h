// SPDX-License-Identifier: Apache-2.0
// Recordings of ROS messages, whatever the file: what is in them, and any message by its place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// An index takes 24 bytes a message; a day of a thousand messages a second has as many.
inline constexpr size_t kBagMessagesMax = 86'400'000;
/// The largest image that is read is 16 Mpx of floats.
inline constexpr size_t kBagMessageBytesMax = size_t{128} << 20;

/// One publisher of one topic.
struct BagConnection {
  /// Within its file.
  uint32_t id = 0;
  std::string topic;
  /// "sensor_msgs/Imu", also of ROS 2's "sensor_msgs/msg/Imu". With an encoding in brackets, which
  /// no type that is read has, when its messages cannot be read.
  std::string type;
  RosEncoding encoding = RosEncoding::kRos1;
  int64_t message_count = 0;
};

struct BagMessageRef {
  /// When it was recorded, by the recorder's clock.
  TimeNs bag_time_ns = 0;
  /// Index into connections().
  uint32_t connection = 0;
  /// The piece of the file that it is in, and where in there: for the bag alone to know.
  uint32_t chunk = 0;
  uint64_t offset = 0;
};

/// The bytes of one message, kept alive.
struct BagMessage {
  std::shared_ptr<const std::string> owner;
  RosBytes data;
};

/// Threads: any number of callers once open.
class Bag {
 public:
  virtual ~Bag() = default;

  /// "rosbag", "mcap" or "rosbag2".
  virtual std::string_view format() const = 0;
  /// As messages print it.
  virtual const std::string& path() const = 0;
  /// The files that it consists of.
  virtual std::vector<std::string> files() const { return {path()}; }
  virtual const std::vector<BagConnection>& connections() const = 0;
  /// In the order in which they were recorded.
  virtual const std::vector<BagMessageRef>& messages() const = 0;

  /// A message's bytes, or the first `byte_count_max` of them; the latter reads less of some bags.
  /// Messages that ROS 2 compressed one by one are unpacked.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the file and the place in it.
  absl::StatusOr<BagMessage> Read(const BagMessageRef& message,
                                  size_t byte_count_max = SIZE_MAX) const;

 protected:
  virtual absl::StatusOr<BagMessage> ReadFirst(const BagMessageRef& message,
                                               size_t byte_count_max) const = 0;
};

/// Opens a file by its first bytes, or a folder of ROS 2 (its metadata.yaml, or bags in it) as one
/// bag.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the place, and what repairs such a bag.
absl::StatusOr<std::shared_ptr<const Bag>> OpenBagFiles(const std::string& path);

/// "bag.bag: topic /imu0 message 3".
std::string BagOrigin(const Bag& bag, const std::string& topic, int64_t number);

/// "sensor_msgs/msg/Imu" and the encoding that a bag names as a connection has them.
std::string BagTypeName(std::string_view type, std::string_view encoding);
RosEncoding BagEncoding(std::string_view encoding);

/// Orders by time; what was recorded at one instant stays in the order of the files.
void SortBagMessages(std::vector<BagMessageRef>* messages);

}  // namespace dsg::ingest
