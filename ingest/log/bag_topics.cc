// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_topics.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/bag_calibration.h"
#include "ingest/log/body_topology.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/image_channel.h"
#include "ingest/log/image_header.h"
#include "ingest/log/label_table.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kImageType[] = "sensor_msgs/Image";
constexpr char kCompressedType[] = "sensor_msgs/CompressedImage";
// What image_transport adds to the name of a topic.
constexpr char kCompressed[] = "/compressed";
constexpr char kCompressedDepth[] = "/compressedDepth";
constexpr char kCloudType[] = "sensor_msgs/PointCloud2";
constexpr char kPoseWithCovarianceType[] = "geometry_msgs/PoseWithCovarianceStamped";
constexpr char kStringType[] = "std_msgs/String";
// What a person has told the localisation (RViz), no pose that was measured.
constexpr char kInitialPose[] = "/initialpose";
constexpr char kLabels[] = "/dsg/labels";
constexpr char kBodyTopology[] = "/dsg/body_topology";
constexpr char kLabelColors[] = "/tesse/seg_cam/rgb/image_raw";

struct KnownTopic {
  const char* name;
  const char* type;
  TopicUse use;
  const char* channel;
};

// Source: the topics of uHumans2 (Rosinol et al., 2021) and of the EuRoC bags (Burri et al.,
// 2016); /dsg/... are dsg-simulate's own.
constexpr KnownTopic kKnown[] = {
    {"/tesse/left_cam/mono/image_raw", kImageType, TopicUse::kImage, "cam0"},
    {"/tesse/right_cam/mono/image_raw", kImageType, TopicUse::kImage, "cam1"},
    {"/tesse/left_cam/rgb/image_raw", kImageType, TopicUse::kImage, "color0"},
    {"/tesse/depth_cam/mono/image_raw", kImageType, TopicUse::kImage, "depth0"},
    {"/dsg/label/image_raw", kImageType, TopicUse::kImage, "label0"},
    {kLabelColors, kImageType, TopicUse::kImage, "label0"},
    {"/tesse/imu/noisy/imu", "sensor_msgs/Imu", TopicUse::kImu, "imu0"},
    {"/tesse/odom", "nav_msgs/Odometry", TopicUse::kTruth, "poses"},
    {"/dsg/detections", kStringType, TopicUse::kDetections, "detections0"},
    {kLoopTopic, kLoopType, TopicUse::kLoops, kLoopChannel},
    {"/cam0/image_raw", kImageType, TopicUse::kImage, "cam0"},
    {"/cam1/image_raw", kImageType, TopicUse::kImage, "cam1"},
    {"/imu0", "sensor_msgs/Imu", TopicUse::kImu, "imu0"},
};

struct ChannelType {
  const char* channel;
  const char* type;
  TopicUse use;
};

// What may be named for a channel. "truth" is the channel "poses" by another source.
constexpr ChannelType kChannelTypes[] = {
    {"cam0", kImageType, TopicUse::kImage},
    {"cam0", kCompressedType, TopicUse::kCompressedImage},
    {"cam1", kImageType, TopicUse::kImage},
    {"cam1", kCompressedType, TopicUse::kCompressedImage},
    {"color0", kImageType, TopicUse::kImage},
    {"color0", kCompressedType, TopicUse::kCompressedImage},
    {"depth0", kImageType, TopicUse::kImage},
    {"depth0", kCompressedType, TopicUse::kCompressedImage},
    {"label0", kImageType, TopicUse::kImage},
    {"label0", kCompressedType, TopicUse::kCompressedImage},
    {"lidar0", kCloudType, TopicUse::kCloud},
    {"imu0", "sensor_msgs/Imu", TopicUse::kImu},
    {"poses", "nav_msgs/Odometry", TopicUse::kExternal},
    {"poses", "geometry_msgs/PoseStamped", TopicUse::kExternal},
    {"poses", kPoseWithCovarianceType, TopicUse::kExternal},
    {"poses", "geometry_msgs/TransformStamped", TopicUse::kExternal},
    {"truth", "nav_msgs/Odometry", TopicUse::kTruth},
    {"truth", "geometry_msgs/PoseStamped", TopicUse::kTruth},
    {"truth", kPoseWithCovarianceType, TopicUse::kTruth},
    {"truth", "geometry_msgs/TransformStamped", TopicUse::kTruth},
    {"detections0", kStringType, TopicUse::kDetections},
    {kLoopChannel, kLoopType, TopicUse::kLoops},
};

using NamedTopics = std::map<std::string, std::string>;

BagTopic* FindTopic(BagPlan* plan, std::string_view name) {
  for (BagTopic& topic : plan->topics) {
    if (topic.name == name) return &topic;
  }
  return nullptr;
}

// Whether the channel has its topic, or is to have none.
bool IsSettled(const BagPlan& plan, const NamedTopics& named, const std::string& channel) {
  return named.contains(channel) ||
         std::any_of(plan.topics.begin(), plan.topics.end(),
                     [&](const BagTopic& topic) { return topic.channel == channel; });
}

void Use(TopicUse use, const std::string& channel, BagTopic* topic) {
  topic->use = use;
  topic->channel = channel;
  topic->decoding = DecodingOf(channel);
}

absl::Status ListTopics(const Bag& bag, BagPlan* plan) {
  std::map<std::string, size_t> index_of;
  for (const BagConnection& connection : bag.connections()) {
    BagTopic topic{.name = connection.topic, .type = connection.type};
    const auto [entry, is_new] = index_of.try_emplace(connection.topic, plan->topics.size());
    if (is_new) plan->topics.push_back(std::move(topic));
    BagTopic& known = plan->topics[entry->second];
    if (known.type != connection.type) {
      return MakeError(
          Reason::kFileMalformed,
          absl::StrCat(bag.path(), ": topic ", connection.topic, " has messages of ", known.type,
                       " and of ", connection.type, "; give each type a topic of its own"),
          {{"file", bag.path()}, {"topic", connection.topic}});
    }
    known.message_count += connection.message_count;
    plan->topic_of_connection.push_back(entry->second);
  }
  plan->first_messages.resize(plan->topics.size());
  for (const BagMessageRef& message : bag.messages()) {
    std::optional<BagMessageRef>& first =
        plan->first_messages[plan->topic_of_connection[message.connection]];
    if (!first.has_value()) first = message;
  }
  return absl::OkStatus();
}

absl::Status WrongTopic(const Bag& bag, const std::string& channel, const std::string& topic,
                        const std::string& what) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--topic ", channel, "=", absl::Utf8SafeCHexEscape(topic), ": ",
                                bag.path(), " ", what),
                   {{"field", "topic"}, {"value", absl::StrCat(channel, "=", topic)}});
}

// Names of channels, or the types that one of them takes.
std::string Listed(const std::function<const char*(const ChannelType&)>& word_of) {
  std::set<std::string> words;
  for (const ChannelType& known : kChannelTypes) {
    if (const char* const word = word_of(known); word != nullptr) words.insert(word);
  }
  return absl::StrJoin(words, ", ");
}

absl::Status UseNamedTopic(const Bag& bag, const std::string& channel, const std::string& name,
                           BagPlan* plan) {
  const std::string types = Listed(
      [&](const ChannelType& known) { return known.channel == channel ? known.type : nullptr; });
  if (types.empty()) {
    return WrongTopic(bag, channel, name,
                      absl::StrCat("is read as channels ",
                                   Listed([](const ChannelType& known) { return known.channel; })));
  }
  if (name == kNoTopic) return absl::OkStatus();
  BagTopic* const topic = FindTopic(plan, name);
  if (topic == nullptr) {
    std::vector<const BagTopic*> all;
    for (const BagTopic& other : plan->topics) all.push_back(&other);
    return WrongTopic(bag, channel, name,
                      absl::StrCat("does not have the topic; it has ", TopicNames(all)));
  }
  if (topic->use != TopicUse::kNone) {
    return WrongTopic(bag, channel, name, "has one use for a topic; it is named for another one");
  }
  for (const ChannelType& known : kChannelTypes) {
    if (known.channel != channel || known.type != topic->type) continue;
    Use(known.use, known.use == TopicUse::kTruth ? "poses" : channel, topic);
    return absl::OkStatus();
  }
  return WrongTopic(
      bag, channel, name,
      absl::StrCat("has messages of ", absl::Utf8SafeCHexEscape(topic->type.substr(0, 80)),
                   " there; ", channel, " takes ", types));
}

void UseKnownTopics(const NamedTopics& named, BagPlan* plan) {
  for (const KnownTopic& known : kKnown) {
    if (IsSettled(*plan, named, known.channel)) continue;
    BagTopic* topic = FindTopic(plan, known.name);
    if (topic != nullptr && topic->use != TopicUse::kNone) continue;
    if (topic != nullptr && topic->type == known.type) {
      Use(known.use, known.channel, topic);
      continue;
    }
    if (topic != nullptr) {
      plan->notes.push_back(absl::StrCat("topic ", known.name, " is not read: it has messages of ",
                                         absl::Utf8SafeCHexEscape(topic->type.substr(0, 80)), ", ",
                                         known.type, " is due"));
    }
    for (const char* const ending : {kCompressedDepth, kCompressed}) {
      BagTopic* compressed = FindTopic(plan, absl::StrCat(known.name, ending));
      if (known.use == TopicUse::kImage && compressed != nullptr &&
          compressed->use == TopicUse::kNone && compressed->type == kCompressedType &&
          !IsSettled(*plan, named, known.channel)) {
        Use(TopicUse::kCompressedImage, known.channel, compressed);
      }
    }
  }
}

// A topic that is the only one of its type needs no known name.
void UseOnlyTopicOf(const std::string& type, TopicUse use, const std::string& channel,
                    const NamedTopics& named, BagPlan* plan) {
  if (IsSettled(*plan, named, channel)) return;
  BagTopic* only = nullptr;
  for (BagTopic& topic : plan->topics) {
    if (topic.type != type || topic.use != TopicUse::kNone || topic.message_count == 0) continue;
    if (topic.name == kInitialPose) continue;
    if (only != nullptr) return;
    only = &topic;
  }
  if (only == nullptr) return;
  Use(use, channel, only);
  plan->notes.push_back(absl::StrCat("topic ", only->name, ", the only one of type ", type,
                                     ", is taken for ", channel));
}

std::string ChannelOfEncoding(std::string_view encoding) {
  if (encoding == "16UC1" || encoding == "mono16" || encoding == "32FC1") return "depth0";
  return encoding == "mono8" || encoding == "8UC1" ? "cam0" : "color0";
}

// image_transport names the encoding first, as in "rgb8; jpeg compressed bgr8"; some drivers say
// "jpeg" alone, then the picture tells. nullopt for what is no picture, as a frame of a video.
std::optional<std::string> EncodingOf(const RosCompressedImage& image, const std::string& origin) {
  const size_t end = image.format.find(';');
  if (end != std::string::npos) return image.format.substr(0, end);
  const absl::StatusOr<ImageHeader> header = ReadImageHeader(image.data, origin);
  if (!header.ok()) return std::nullopt;
  if (header->channel_count != 1) return "rgb8";
  return header->bits_per_channel > 8 ? "16UC1" : "mono8";
}

using TopicsByName = std::map<std::string_view, const BagTopic*>;

// Recorders that take all topics have a picture in several forms; one is enough.
bool IsHeldBetter(const BagTopic& topic, const TopicsByName& topics) {
  const auto has = [&topics](const std::string& name, std::string_view type) {
    const auto found = topics.find(name);
    return found != topics.end() && found->second->type == type && found->second->message_count > 0;
  };
  for (const char* const ending : {kCompressed, kCompressedDepth}) {
    if (!topic.name.ends_with(ending)) continue;
    const std::string raw = topic.name.substr(0, topic.name.size() - std::strlen(ending));
    if (has(raw, kImageType)) return true;
    return ending == kCompressed && has(raw + kCompressedDepth, kCompressedType);
  }
  return false;
}

// nullopt for a topic that has no picture.
absl::StatusOr<std::optional<std::string>> FirstEncoding(const Bag& bag, const BagPlan& plan,
                                                         const BagTopic& topic) {
  const std::optional<BagMessageRef>& first = plan.FirstOf(topic);
  if (!first.has_value()) return std::nullopt;
  const std::string origin = BagOrigin(bag, topic.name, 1);
  DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(*first));
  if (topic.type == kImageType) {
    DSG_ASSIGN_OR_RETURN(const RosImage image, ParseRosImageHead(message.data, origin));
    return image.encoding;
  }
  DSG_ASSIGN_OR_RETURN(const RosCompressedImage image,
                       ParseRosCompressedImage(message.data, origin));
  return EncodingOf(image, origin);
}

// Cameras of unknown names, by what their first image is: one of depth, one of colour, one grey.
absl::Status UseImagesByEncoding(const Bag& bag, const NamedTopics& named, BagPlan* plan) {
  TopicsByName by_name;
  for (const BagTopic& topic : plan->topics) by_name.emplace(topic.name, &topic);
  std::map<std::string, std::vector<BagTopic*>> topics_of_channel;
  for (BagTopic& topic : plan->topics) {
    if (topic.use == TopicUse::kImage || topic.use == TopicUse::kCompressedImage) {
      // Of a rig whose names are known all are.
      if (!named.contains(topic.channel)) return absl::OkStatus();
      continue;
    }
    const bool is_compressed = topic.type == kCompressedType;
    if (topic.type != kImageType && !is_compressed) continue;
    if (topic.message_count == 0 || (is_compressed && IsHeldBetter(topic, by_name))) continue;
    DSG_ASSIGN_OR_RETURN(const std::optional<std::string> encoding,
                         FirstEncoding(bag, *plan, topic));
    if (encoding.has_value()) topics_of_channel[ChannelOfEncoding(*encoding)].push_back(&topic);
  }
  for (const auto& [channel, topics] : topics_of_channel) {
    if (topics.size() != 1 || IsSettled(*plan, named, channel)) continue;
    const bool is_compressed = topics.front()->type == kCompressedType;
    Use(is_compressed ? TopicUse::kCompressedImage : TopicUse::kImage, channel, topics.front());
    plan->notes.push_back(absl::StrCat("topic ", topics.front()->name, " is taken for ", channel,
                                       " by its encoding"));
  }
  return absl::OkStatus();
}

// The text of a topic that is sent once; its bytes are empty if the bag has no such topic.
absl::StatusOr<LogFile> ReadTextSentOnce(const Bag& bag, const std::string& name, BagPlan* plan) {
  LogFile file{.path = bag.path(), .name = {}, .bytes = {}};
  const BagTopic* topic = FindTopic(plan, name);
  if (topic == nullptr || topic->type != kStringType) return file;
  const std::optional<BagMessageRef>& first = plan->FirstOf(*topic);
  if (!first.has_value()) return file;
  file.path = BagOrigin(bag, topic->name, 1);
  DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(*first));
  DSG_ASSIGN_OR_RETURN(const std::string_view text, ParseRosString(message.data, file.path));
  file.bytes = std::string(text);
  return file;
}

absl::Status ReadBodyTopology(const Bag& bag, BagPlan* plan) {
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTextSentOnce(bag, kBodyTopology, plan));
  if (file.bytes.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(plan->body_topology, ParseBodyTopology(file.path, file.bytes));
  return absl::OkStatus();
}

absl::Status ReadLabels(const Bag& bag, BagPlan* plan) {
  DSG_ASSIGN_OR_RETURN(LogFile file, ReadTextSentOnce(bag, kLabels, plan));
  file.name = "labels.csv";
  const std::filesystem::path beside =
      std::filesystem::path(bag.files().front()).parent_path() / "labels.csv";
  std::error_code error;
  if (file.bytes.empty() && std::filesystem::is_regular_file(beside, error)) {
    DSG_ASSIGN_OR_RETURN(file, ReadLogFile(beside.string()));
    plan->notes.push_back(absl::StrCat("classes of label colours are from ", file.path));
  }
  if (file.bytes.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const LabelTable table, ReadLabelTable(file));
  plan->class_of_color = table.ClassOfColor();
  plan->labels = table.Classes();
  return absl::OkStatus();
}

// Colours of which nobody knows the classes are of no use.
void DropLabelsWithoutTable(BagPlan* plan) {
  BagTopic* topic = FindTopic(plan, kLabelColors);
  if (topic == nullptr || topic->use == TopicUse::kNone || !plan->class_of_color.empty()) return;
  topic->use = TopicUse::kNone;
  topic->channel.clear();
  plan->notes.push_back(
      absl::StrCat(kLabelColors,
                   " shows classes by colours that the bag does not explain: put the scene's "
                   "segmentation mapping beside the bag as labels.csv"));
}

void NoteUnusedTopics(BagPlan* plan) {
  std::vector<const BagTopic*> unused;
  for (const BagTopic& topic : plan->topics) {
    const bool is_known = topic.use != TopicUse::kNone || topic.type == "sensor_msgs/CameraInfo" ||
                          topic.name == "/tf_static" || topic.name == "/tf" ||
                          topic.name == kLabels || topic.name == kBodyTopology;
    if (!is_known) unused.push_back(&topic);
  }
  if (unused.empty()) return;
  plan->notes.push_back(absl::StrCat("topics that are not read: ", TopicNames(unused)));
}

}  // namespace

std::string TopicNames(const std::vector<const BagTopic*>& topics) {
  // Recordings of some cameras have a hundred topics of settings, hostile ones a million.
  constexpr size_t kNamedMax = 20;
  std::vector<std::string> names;
  for (const BagTopic* const topic : topics) {
    if (names.size() == kNamedMax) break;
    // A name may be any bytes; a terminal must not obey them.
    names.push_back(absl::Utf8SafeCHexEscape(absl::StrCat(topic->name.substr(0, 120), " (",
                                                          topic->message_count, " ",
                                                          topic->type.substr(0, 80), ")")));
  }
  const size_t more = topics.size() - names.size();
  return absl::StrCat(absl::StrJoin(names, ", "),
                      more > 0 ? absl::StrCat(" and ", more, " more") : "");
}

absl::StatusOr<BagPlan> PlanBag(const Bag& bag, const NamedTopics& named) {
  BagPlan plan;
  DSG_RETURN_IF_ERROR(ListTopics(bag, &plan));
  for (const auto& [channel, topic] : named) {
    DSG_RETURN_IF_ERROR(UseNamedTopic(bag, channel, topic, &plan));
  }
  UseKnownTopics(named, &plan);
  DSG_RETURN_IF_ERROR(ReadLabels(bag, &plan));
  DSG_RETURN_IF_ERROR(ReadBodyTopology(bag, &plan));
  DropLabelsWithoutTable(&plan);
  DSG_RETURN_IF_ERROR(UseImagesByEncoding(bag, named, &plan));
  UseOnlyTopicOf(kCloudType, TopicUse::kCloud, "lidar0", named, &plan);
  UseOnlyTopicOf("sensor_msgs/Imu", TopicUse::kImu, "imu0", named, &plan);
  for (const char* type : {"nav_msgs/Odometry", "geometry_msgs/PoseStamped",
                           kPoseWithCovarianceType, "geometry_msgs/TransformStamped"}) {
    UseOnlyTopicOf(type, TopicUse::kExternal, "poses", named, &plan);
  }
  DSG_RETURN_IF_ERROR(ReadBagCalibration(bag, &plan));
  NoteUnusedTopics(&plan);
  return plan;
}

}  // namespace dsg::ingest
