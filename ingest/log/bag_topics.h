// SPDX-License-Identifier: Apache-2.0
// Which topics of a bag are which sensors, and what the bag says of their calibration.
// Refuses to read the stream of measurements: only what is said once.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/image_file.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

inline constexpr char kPoseChannel[] = "poses";
/// Loop closures: their channel, their topic unless another is named, and its type.
inline constexpr char kLoopChannel[] = "loops0";
inline constexpr char kLoopTopic[] = "/dsg/loop_closures";
inline constexpr char kLoopType[] = "std_msgs/String";

enum class TopicUse {
  kNone,
  kImage,
  kCompressedImage,
  kCloud,
  kImu,
  kTruth,
  kExternal,
  kDetections,
  kLoops,
};

/// What becomes of a topic.
struct BagTopic {
  std::string name;
  std::string type;
  int64_t message_count = 0;
  TopicUse use = TopicUse::kNone;
  /// "cam0"; empty for kNone.
  std::string channel;
  ImageDecoding decoding;
};

struct BagPlan {
  /// By name.
  std::vector<BagTopic> topics;
  /// Index into `topics` of each connection.
  std::vector<size_t> topic_of_connection;
  /// By topic; none of topics without messages.
  std::vector<std::optional<BagMessageRef>> first_messages;

  const std::optional<BagMessageRef>& FirstOf(const BagTopic& topic) const {
    return first_messages[static_cast<size_t>(&topic - topics.data())];
  }
  RigCalibration rig;
  std::map<uint32_t, int32_t> class_of_color;
  std::vector<SemanticLabel> labels;
  /// The faces of bodies; null when the bag has none.
  std::shared_ptr<const Topology> body_topology;
  /// LogOptions::is_strict.
  bool is_strict = false;
  std::vector<std::string> notes;
};

/// Looks at the names and types, and reads the messages that are sent once: camera infos, static
/// transforms, labels (or labels.csv beside the bag), the faces of bodies. `named` is
/// LogOptions::topics. Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the topic; FIELD_INVALID for
/// a named topic that the bag does not have or that is of another type than its channel, and a
/// channel that there is not.
absl::StatusOr<BagPlan> PlanBag(const Bag& bag, const std::map<std::string, std::string>& named);

/// "/imu0 (49 sensor_msgs/Imu), ... and 7 more", fit for a terminal.
std::string TopicNames(const std::vector<const BagTopic*>& topics);

}  // namespace dsg::ingest
