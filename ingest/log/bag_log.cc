// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_log.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/bag.h"
#include "ingest/log/bag_identity.h"
#include "ingest/log/bag_topics.h"
#include "ingest/log/bag_transforms.h"
#include "ingest/log/detection_json.h"
#include "ingest/log/followed_log.h"
#include "ingest/log/growing_bag.h"
#include "ingest/log/image_file.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/ros_cloud.h"
#include "ingest/log/ros_image.h"
#include "ingest/log/ros_messages.h"
#include "ingest/log/sensor_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Topics are recorded when they arrive, which is a little after their stamps and not all alike.
constexpr TimeNs kHorizonNs = kNsPerSecond;
// Far more than a second of any rig; stamps that all are equal must not fill the memory.
constexpr size_t kWaitingMax = 200'000;
// The head of an image: stamp, frame, size, encoding.
constexpr size_t kImageHeadBytes = 4096;

struct Key {
  TimeNs time_ns = 0;
  ChannelRank rank = ChannelRank::kImages;
  std::string channel;
  int64_t sequence = 0;

  auto operator<=>(const Key&) const = default;
};

// Of pixels, which are not read before somebody asks for them.
bool IsImage(TopicUse use) {
  return use == TopicUse::kImage || use == TopicUse::kCompressedImage || use == TopicUse::kCloud;
}

ChannelRank RankOf(TopicUse use) {
  switch (use) {
    case TopicUse::kImu:
      return ChannelRank::kImu;
    case TopicUse::kTruth:
    case TopicUse::kExternal:
      return ChannelRank::kPoses;
    case TopicUse::kDetections:
      return ChannelRank::kDetections;
    default:
      return ChannelRank::kImages;
  }
}

TimeNs TimeOf(const Measurement& measurement) {
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) return imu->time_ns;
  if (const auto* image = std::get_if<ImageMeasurement>(&measurement)) return image->time_ns;
  if (const auto* pose = std::get_if<PoseMeasurement>(&measurement)) return pose->pose.time_ns;
  return std::get<HumanDetection>(measurement).time_ns;
}

class BagLog : public LogSource {
 public:
  /// `growing`: null for a bag that is there as a whole.
  BagLog(std::shared_ptr<const Bag> bag, std::unique_ptr<GrowingBag> growing, BagPlan plan,
         std::string robot_name, LogInfo info)
      : info_(std::move(info)),
        is_usable_(info_.measurement_count > 0),
        bag_(std::move(bag)),
        growing_(std::move(growing)),
        plan_(std::move(plan)),
        class_of_color_(std::make_shared<const std::map<uint32_t, int32_t>>(plan_.class_of_color)),
        robot_name_(std::move(robot_name)),
        numbers_(plan_.topics.size(), 0),
        last_(plan_.topics.size()) {
    // Nobody knows how many there will be.
    if (growing_ != nullptr) info_.measurement_count = 0;
  }

  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override {
    if (growing_ != nullptr) growing_->file().SetIdle(std::move(idle));
  }

  /// What is known as a whole before the bag is read: poses and loop closures.
  void AddKnown(SensorChannel channel) {
    known_.push_back({std::move(channel)});
    is_usable_ = true;
  }

  /// Reads until the first measurement is known.
  absl::Status FindFirst() {
    DSG_RETURN_IF_ERROR(Fill());
    TimeNs first_ns = waiting_.empty() ? kTimeMax : waiting_.begin()->first.time_ns;
    for (const Known& known : known_) {
      if (!known.IsAtEnd()) first_ns = std::min(first_ns, known.key().first);
    }
    if (first_ns == kTimeMax) first_ns = 0;
    info_.first_ns = first_ns;
    info_.clock = ClockOf(first_ns);
    return absl::OkStatus();
  }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (!is_usable_) return NothingUsable();
    DSG_RETURN_IF_ERROR(Fill());
    // What could still be overtaken is read again when the log is taken up again.
    if (IsStopped() && UsedTopicCount() > 1) return std::nullopt;
    Known* const known = FirstKnown();
    if (known != nullptr &&
        (waiting_.empty() ||
         known->key() < std::pair(waiting_.begin()->first.time_ns, waiting_.begin()->first.rank))) {
      DSG_ASSIGN_OR_RETURN(Measurement measurement, known->channel.make(known->next++));
      return measurement;
    }
    if (waiting_.empty()) return std::nullopt;
    auto first = waiting_.extract(waiting_.begin());
    emitted_ns_ = first.key().time_ns;
    return std::move(first.mapped());
  }

 private:
  struct Known {
    SensorChannel channel;
    size_t next = 0;

    bool IsAtEnd() const { return next == channel.times.size(); }
    std::pair<TimeNs, ChannelRank> key() const { return {channel.times[next], channel.rank}; }
  };

  Known* FirstKnown() {
    Known* first = nullptr;
    for (Known& known : known_) {
      if (known.IsAtEnd()) continue;
      if (first == nullptr || known.key() < first->key()) first = &known;
    }
    return first;
  }

  absl::Status NothingUsable() const {
    std::vector<const BagTopic*> topics;
    for (const BagTopic& topic : plan_.topics) topics.push_back(&topic);
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(info_.path, ": the bag holds no topic that can be used; it has: ",
                                  TopicNames(topics), "; see docs/sensor_logs.md"),
                     {{"file", info_.path}});
  }

  bool IsStopped() const { return growing_ != nullptr && growing_->file().IsStopped(); }

  int64_t UsedTopicCount() const {
    return std::count_if(plan_.topics.begin(), plan_.topics.end(),
                         [](const BagTopic& topic) { return topic.use != TopicUse::kNone; });
  }

  // Whether what comes first can no longer be overtaken.
  bool HasNext() const {
    if (waiting_.empty()) return false;
    return latest_ns_ - waiting_.begin()->first.time_ns >= kHorizonNs ||
           (growing_ != nullptr && UsedTopicCount() == 1);
  }

  // Whether there are messages that were not taken.
  absl::StatusOr<bool> HasMore() {
    if (next_ < bag_->messages().size()) return true;
    if (growing_ == nullptr || is_ended_) return false;
    DSG_ASSIGN_OR_RETURN(const bool has_more, growing_->Wait());
    if (!has_more) EndGrowth();
    return has_more;
  }

  void EndGrowth() {
    is_ended_ = true;
    if (late_topics_.empty()) return;
    info_.notes.push_back(absl::StrCat(
        "topics that came later than ", kFollowedBeginNs / kNsPerSecond,
        " s after the first message and were not read: ", absl::StrJoin(late_topics_, ", ")));
  }

  // Gives the connections that are new a topic: that of their name, or none.
  void PlanLateConnections() {
    const std::vector<BagConnection>& connections = bag_->connections();
    for (size_t i = plan_.topic_of_connection.size(); i < connections.size(); ++i) {
      const auto same =
          std::find_if(plan_.topics.begin(), plan_.topics.end(), [&](const BagTopic& topic) {
            return topic.name == connections[i].topic && topic.type == connections[i].type;
          });
      plan_.topic_of_connection.push_back(static_cast<size_t>(same - plan_.topics.begin()));
      if (same != plan_.topics.end()) continue;
      constexpr size_t kNamedMax = 20;
      if (late_topics_.size() < kNamedMax) {
        late_topics_.push_back(absl::Utf8SafeCHexEscape(connections[i].topic.substr(0, 120)));
      }
      BagTopic topic;
      topic.name = connections[i].topic;
      topic.type = connections[i].type;
      plan_.topics.push_back(std::move(topic));
      plan_.first_messages.emplace_back();
      numbers_.push_back(0);
      last_.emplace_back();
    }
  }

  // Until what comes first can no longer be overtaken.
  absl::Status Fill() {
    while (!HasNext()) {
      DSG_ASSIGN_OR_RETURN(const bool has_more, HasMore());
      if (!has_more) return absl::OkStatus();
      PlanLateConnections();
      const BagMessageRef ref = bag_->messages()[next_++];
      const size_t topic = plan_.topic_of_connection[ref.connection];
      if (plan_.topics[topic].use == TopicUse::kNone) continue;
      DSG_RETURN_IF_ERROR(Take(ref, topic));
      if (waiting_.size() > kWaitingMax) {
        return Malformed(
            topic, absl::StrCat("more than ", kWaitingMax, " messages lie within one second"));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Take(const BagMessageRef& ref, size_t index) {
    const BagTopic& topic = plan_.topics[index];
    ++numbers_[index];
    const std::string origin = BagOrigin(*bag_, topic.name, numbers_[index]);
    DSG_ASSIGN_OR_RETURN(Measurement measurement, Read(ref, topic, origin));
    int64_t sequence = numbers_[index];
    if (const auto* detection = std::get_if<HumanDetection>(&measurement)) {
      sequence = detection->id;
    }
    Key key{TimeOf(measurement), RankOf(topic.use), topic.channel, sequence};
    DSG_RETURN_IF_ERROR(CheckOrder(key, index));
    latest_ns_ = std::max(latest_ns_, key.time_ns);
    waiting_.emplace(std::move(key), std::move(measurement));
    return absl::OkStatus();
  }

  absl::Status CheckOrder(const Key& key, size_t index) {
    std::optional<Key>& last = last_[index];
    // Several people are seen in one image.
    const bool is_after = !last.has_value() || key.time_ns > last->time_ns ||
                          (key.rank == ChannelRank::kDetections && key > *last);
    if (!is_after && key.time_ns == 0) {
      return Malformed(index,
                       "has stamp 0, as the one before: its publisher does not stamp; set the "
                       "stamps to the times of recording, or leave the topic out");
    }
    if (!is_after) {
      return Malformed(index,
                       absl::StrCat("has stamp ", key.time_ns, " after stamp ", last->time_ns,
                                    "; stamps must grow within a topic: sort or filter the "
                                    "bag"));
    }
    if (key.time_ns < emitted_ns_) {
      return Malformed(index,
                       absl::StrCat("has stamp ", key.time_ns,
                                    ", more than a second before "
                                    "stamp ",
                                    latest_ns_, " of another topic; do they share a clock?"));
    }
    last = key;
    return absl::OkStatus();
  }

  absl::Status Malformed(size_t topic, const std::string& message) const {
    return MakeError(
        Reason::kFileMalformed,
        absl::StrCat(BagOrigin(*bag_, plan_.topics[topic].name, numbers_[topic]), " ", message),
        {{"file", bag_->path()}, {"topic", plan_.topics[topic].name}});
  }

  absl::StatusOr<Measurement> Read(const BagMessageRef& ref, const BagTopic& topic,
                                   const std::string& origin) const {
    const bool is_image = IsImage(topic.use);
    DSG_ASSIGN_OR_RETURN(const BagMessage message,
                         bag_->Read(ref, is_image ? kImageHeadBytes : SIZE_MAX));
    if (is_image) {
      DSG_ASSIGN_OR_RETURN(const RosHeader header, ParseRosHeader(message.data, origin));
      return Measurement(MakeImage(ref, topic, header.stamp_ns, origin));
    }
    if (topic.use == TopicUse::kImu) {
      DSG_ASSIGN_OR_RETURN(const RosImu imu, ParseRosImu(message.data, origin));
      return Measurement(
          ImuMeasurement{imu.header.stamp_ns, imu.angular_velocity, imu.acceleration});
    }
    if (topic.use == TopicUse::kDetections) {
      DSG_ASSIGN_OR_RETURN(const std::string_view text, ParseRosString(message.data, origin));
      DSG_ASSIGN_OR_RETURN(HumanDetection detection, ParseDetection(LinePosition{origin, 1}, text));
      return Measurement(std::move(detection));
    }
    return ReadPose(message.data, topic, origin);
  }

  absl::StatusOr<Measurement> ReadPose(const RosBytes& bytes, const BagTopic& topic,
                                       const std::string& origin) const {
    DSG_ASSIGN_OR_RETURN(const RosPose pose, ParseRosPoseOf(topic.type, bytes, origin));
    DSG_ASSIGN_OR_RETURN(const Pose3d map_T_body, pose.ToPose(origin));
    return Measurement(
        PoseMeasurement{.agent_name = robot_name_,
                        .agent_kind = kinds::kRobot,
                        .pose = {.time_ns = pose.header.stamp_ns,
                                 .flags = 0,
                                 .map_T_agent = map_T_body,
                                 .covariance = nullptr},
                        .line = numbers_[static_cast<size_t>(&topic - plan_.topics.data())]});
  }

  ImageMeasurement MakeImage(const BagMessageRef& ref, const BagTopic& topic, TimeNs time_ns,
                             const std::string& origin) const {
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

  LogInfo info_;
  bool is_usable_;
  std::shared_ptr<const Bag> bag_;
  std::unique_ptr<GrowingBag> growing_;
  bool is_ended_ = false;
  std::vector<std::string> late_topics_;
  BagPlan plan_;
  std::shared_ptr<const std::map<uint32_t, int32_t>> class_of_color_;
  std::string robot_name_;
  std::vector<Known> known_;
  size_t next_ = 0;
  /// By topic: messages seen, and the last one's key.
  std::vector<int64_t> numbers_;
  std::vector<std::optional<Key>> last_;
  TimeNs latest_ns_ = 0;
  TimeNs emitted_ns_ = 0;
  std::map<Key, Measurement> waiting_;
};

bool HasUse(const BagPlan& plan, TopicUse use) {
  return std::any_of(plan.topics.begin(), plan.topics.end(),
                     [use](const BagTopic& topic) { return topic.use == use; });
}

bool IsSensor(TopicUse use) { return use == TopicUse::kImu || IsImage(use); }

// By the headers of the first and last message of each sensor; what cannot be read is left for the
// reader of the log to report.
StampSpan SensorSpan(const Bag& bag, const BagPlan& plan) {
  std::vector<std::pair<const BagMessageRef*, const BagMessageRef*>> ends(plan.topics.size());
  for (const BagMessageRef& ref : bag.messages()) {
    auto& [first, last] = ends[plan.topic_of_connection[ref.connection]];
    if (first == nullptr) first = &ref;
    last = &ref;
  }
  StampSpan span;
  for (size_t i = 0; i < ends.size(); ++i) {
    if (!IsSensor(plan.topics[i].use) || ends[i].first == nullptr) continue;
    for (const BagMessageRef* const ref : {ends[i].first, ends[i].second}) {
      const auto message = bag.Read(*ref, kImageHeadBytes);
      if (!message.ok()) continue;
      const auto header = ParseRosHeader(message->data, plan.topics[i].name);
      if (header.ok()) span.Add(header->stamp_ns);
    }
  }
  return span;
}

absl::StatusOr<std::optional<TrackTable>> ReadTransformPoses(const Bag& bag,
                                                             const LogOptions& options,
                                                             LogInfo* info) {
  DSG_ASSIGN_OR_RETURN(const TransformTree tree, TransformTree::Read(bag, /*with_moving=*/true));
  return tree.ReadPoses(bag, RobotName(options), &info->notes);
}

// Leaves one source of poses in the plan; gives the table of a pose file, or of /tf.
absl::StatusOr<std::optional<TrackTable>> PlanPoses(const Bag& bag, const LogOptions& options,
                                                    BagPlan* plan, LogDigest* digest,
                                                    LogInfo* info) {
  const bool from_file = !options.pose_file.empty();
  std::optional<TrackTable> table;
  PoseChoice choice = PoseChoice::kNone;
  if (from_file) {
    DSG_ASSIGN_OR_RETURN(table, ChoosePoses(options, {}, digest, info));
  } else {
    const bool has_truth = HasUse(*plan, TopicUse::kTruth);
    const bool has_external = HasUse(*plan, TopicUse::kExternal);
    // A topic of poses goes before the transforms, which take a pass over the bag.
    const bool wants_truth = options.poses == PoseSource::kGroundTruth ||
                             (options.poses == PoseSource::kAuto && has_truth);
    // Of a followed bag nobody knows them all.
    const bool can_take_transforms = !options.follow.has_value() && HasMovingTransforms(bag);
    if (!has_external && !wants_truth && can_take_transforms) {
      DSG_ASSIGN_OR_RETURN(table, ReadTransformPoses(bag, options, info));
    }
    DSG_ASSIGN_OR_RETURN(
        choice, ChoosePoseKind(options, has_truth, has_external || table.has_value(), info->path));
  }
  for (BagTopic& topic : plan->topics) {
    const bool is_taken = (topic.use == TopicUse::kTruth && choice == PoseChoice::kGroundTruth) ||
                          (topic.use == TopicUse::kExternal && choice == PoseChoice::kExternal);
    if (is_taken) {
      info->notes.push_back(absl::StrCat(
          "the robot's poses are ",
          topic.use == TopicUse::kTruth ? "the log's ground truth: " : "external: ", topic.name));
    } else if (topic.use == TopicUse::kTruth || topic.use == TopicUse::kExternal) {
      topic.use = TopicUse::kNone;
    }
  }
  if (table.has_value() && !from_file) {
    info->notes.push_back(absl::StrCat("the robot's poses are external: ", table->file));
  } else if (options.follow.has_value() && choice == PoseChoice::kNone) {
    info->notes.push_back(
        "a bag that is followed gives poses from a topic of poses only, not from /tf");
  } else if (HasMovingTransforms(bag) && choice != PoseChoice::kNone) {
    info->notes.push_back("/tf is not taken for poses: a topic of poses goes before it");
  }
  if (!from_file && choice == PoseChoice::kNone) {
    info->notes.push_back(
        "the log holds no poses of the robot, so nothing can be mapped; give --pose-file");
  }
  return table;
}

// Loop closures are found, and recorded, long after their stamps: they are read before the rest.
absl::StatusOr<std::optional<SensorChannel>> ReadLoops(const Bag& bag, const LogOptions& options,
                                                       BagPlan* plan, LogDigest* digest,
                                                       LogInfo* info) {
  LoopLines loops;
  bool has_topic = false;
  std::vector<int64_t> numbers(plan->topics.size(), 0);
  for (const BagMessageRef& ref : bag.messages()) {
    const size_t index = plan->topic_of_connection[ref.connection];
    const BagTopic& topic = plan->topics[index];
    if (topic.use != TopicUse::kLoops || !options.loop_file.empty()) continue;
    has_topic = true;
    const std::string origin = BagOrigin(bag, topic.name, ++numbers[index]);
    DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(ref));
    DSG_ASSIGN_OR_RETURN(const std::string_view text, ParseRosString(message.data, origin));
    DSG_RETURN_IF_ERROR(loops.Add(LinePosition{origin, 1}, text));
  }
  for (BagTopic& topic : plan->topics) {
    if (topic.use == TopicUse::kLoops) topic.use = TopicUse::kNone;
  }
  if (has_topic) return loops.TakeChannel(&info->notes);
  return ReadLoopChannel(options, /*log_path=*/"", digest, info);
}

// What the plan says of a log, besides its poses and its identity.
LogInfo InfoOf(const Bag& bag, const BagPlan& plan) {
  LogInfo info;
  info.format = bag.format();
  info.path = bag.path();
  info.has_clock = true;
  info.rig = plan.rig;
  info.labels = plan.labels;
  info.notes = plan.notes;
  return info;
}

void CountTopics(const BagPlan& plan, LogInfo* info) {
  for (const BagTopic& topic : plan.topics) {
    if (topic.use == TopicUse::kNone) continue;
    info->channel_counts[topic.channel] += topic.message_count;
    info->measurement_count += topic.message_count;
  }
}

void Count(const SensorChannel& channel, LogInfo* info) {
  const auto count = static_cast<int64_t>(channel.times.size());
  info->channel_counts[channel.name] = count;
  info->measurement_count += count;
}

}  // namespace

OpenedLog OpenBag(const std::string& path, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Bag> bag, OpenBagFiles(path));
  DSG_ASSIGN_OR_RETURN(BagPlan plan, PlanBag(*bag, options.topics));
  LogInfo info = InfoOf(*bag, plan);
  LogDigest digest;
  DSG_ASSIGN_OR_RETURN(std::optional<TrackTable> poses,
                       PlanPoses(*bag, options, &plan, &digest, &info));
  // While it still says which topic has the loop closures.
  AddBagContent(*bag, plan, options.pose_file.empty() ? poses : std::nullopt, &digest);
  DSG_ASSIGN_OR_RETURN(std::optional<SensorChannel> loops,
                       ReadLoops(*bag, options, &plan, &digest, &info));
  info.content_sha256 = digest.Hex();
  CountTopics(plan, &info);
  std::vector<SensorChannel> known;
  if (poses.has_value()) {
    known.push_back(MakePoseChannel(*std::move(poses)));
    StampSpan span;
    for (const TimeNs time_ns : known.back().times) span.Add(time_ns);
    DSG_RETURN_IF_ERROR(CheckSharesTime(options, span, path, SensorSpan(*bag, plan)));
  }
  if (loops.has_value()) known.push_back(*std::move(loops));
  for (const SensorChannel& channel : known) Count(channel, &info);
  auto log = std::make_unique<BagLog>(std::move(bag), nullptr, std::move(plan), RobotName(options),
                                      std::move(info));
  for (SensorChannel& channel : known) log->AddKnown(std::move(channel));
  DSG_RETURN_IF_ERROR(log->FindFirst());
  return std::unique_ptr<LogSource>(std::move(log));
}

OpenedLog OpenFollowedBag(std::unique_ptr<GrowingFile> file, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GrowingBag> growing, GrowingBag::Open(std::move(file)));
  DSG_ASSIGN_OR_RETURN(const size_t message_count, growing->WaitForBegin(kFollowedBeginNs));
  const std::shared_ptr<const Bag> bag = growing->bag();
  const BagBegin begin(*bag, message_count);
  DSG_ASSIGN_OR_RETURN(BagPlan plan, PlanBag(begin, options.topics));
  LogInfo info = InfoOf(begin, plan);
  info.notes.push_back("the log is followed: it is committed while it grows");
  for (BagTopic& topic : plan.topics) {
    if (topic.use != TopicUse::kLoops) continue;
    topic.use = TopicUse::kNone;
    info.notes.push_back(
        absl::StrCat(topic.name,
                     " is not read: loop closures are told after their times, "
                     "and must be known before; take the bag when it is finished"));
  }
  LogDigest digest;
  DSG_RETURN_IF_ERROR(PlanPoses(begin, options, &plan, &digest, &info).status());
  AddBagContent(begin, plan, std::nullopt, &digest);
  // A bag of the same first seconds that is taken as a whole is another session.
  digest.AddSize("followed", 0);
  info.content_sha256 = digest.Hex();
  CountTopics(plan, &info);
  auto log = std::make_unique<BagLog>(bag, std::move(growing), std::move(plan), RobotName(options),
                                      std::move(info));
  DSG_RETURN_IF_ERROR(log->FindFirst());
  return std::unique_ptr<LogSource>(std::move(log));
}

}  // namespace dsg::ingest
