// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_log.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag.h"
#include "ingest/log/bag_identity.h"
#include "ingest/log/bag_measurement.h"
#include "ingest/log/bag_stream.h"
#include "ingest/log/bag_topics.h"
#include "ingest/log/bag_transforms.h"
#include "ingest/log/followed_log.h"
#include "ingest/log/followed_transforms.h"
#include "ingest/log/growing_bag.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/ros_messages.h"
#include "ingest/log/sensor_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

bool HasUse(const BagPlan& plan, TopicUse use) {
  return std::any_of(plan.topics.begin(), plan.topics.end(),
                     [use](const BagTopic& topic) { return topic.use == use; });
}

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

// What a bag has of the robot's poses besides topics.
struct BagPoses {
  /// Of a pose file, or of /tf; of a followed bag those of its begin.
  std::optional<TrackTable> table;
  /// Of a followed bag whose poses /tf gives.
  std::optional<FollowedTransforms> followed;
};

absl::Status ReadTransformPoses(const Bag& bag, const LogOptions& options, BagPoses* poses,
                                LogInfo* info) {
  DSG_ASSIGN_OR_RETURN(TransformTree tree,
                       TransformTree::Read(bag, /*with_moving=*/true, options.on_pass));
  // What is passed over of a followed bag is counted at its end.
  std::vector<std::string> notes_of_begin;
  std::vector<std::string>* const notes =
      options.follow.has_value() ? &notes_of_begin : &info->notes;
  DSG_ASSIGN_OR_RETURN(poses->table,
                       tree.ReadPoses(bag, RobotName(options), notes, options.on_pass));
  if (!options.follow.has_value() || !poses->table.has_value()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(poses->followed, FollowedTransforms::Make(std::move(tree)));
  return absl::OkStatus();
}

// Leaves one source of poses in the plan; gives the table of a pose file, or of /tf.
absl::StatusOr<BagPoses> PlanPoses(const Bag& bag, const LogOptions& options, BagPlan* plan,
                                   LogDigest* digest, LogInfo* info) {
  const bool from_file = !options.pose_file.empty();
  BagPoses poses;
  PoseChoice choice = PoseChoice::kNone;
  if (from_file) {
    DSG_ASSIGN_OR_RETURN(poses.table, ChoosePoses(options, {}, digest, info));
  } else {
    const bool has_truth = HasUse(*plan, TopicUse::kTruth);
    const bool has_external = HasUse(*plan, TopicUse::kExternal);
    // A topic of poses goes before the transforms, which take a pass over the bag.
    const bool wants_truth = options.poses == PoseSource::kGroundTruth ||
                             (options.poses == PoseSource::kAuto && has_truth);
    const bool wants_any = options.poses != PoseSource::kOdometry;
    if (wants_any && !has_external && !wants_truth && HasMovingTransforms(bag)) {
      DSG_RETURN_IF_ERROR(ReadTransformPoses(bag, options, &poses, info));
    }
    DSG_ASSIGN_OR_RETURN(
        choice,
        ChoosePoseKind(options, has_truth, has_external || poses.table.has_value(), info->path));
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
  if (poses.table.has_value() && !from_file) {
    info->notes.push_back(absl::StrCat("the robot's poses are external: ", poses.table->file));
  } else if (HasMovingTransforms(bag) && choice != PoseChoice::kNone) {
    info->notes.push_back("/tf is not taken for poses: a topic of poses goes before it");
  }
  if (!from_file && choice == PoseChoice::kNone && options.poses != PoseSource::kOdometry) {
    info->notes.push_back(
        "the log holds no poses of the robot, so nothing can be mapped; let them be estimated "
        "(--poses vio) or give --pose-file");
  }
  return poses;
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
  info.body_topology = plan.body_topology;
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

void Count(const std::string& channel, size_t count, LogInfo* info) {
  info->channel_counts[channel] = static_cast<int64_t>(count);
  info->measurement_count += static_cast<int64_t>(count);
}

// LogOptions::topics, of which that of loop closures need not be there yet.
std::map<std::string, std::string> TopicsOfBegin(const Bag& begin, const LogOptions& options) {
  std::map<std::string, std::string> topics = options.topics;
  const auto loops = topics.find(kLoopChannel);
  if (loops == topics.end()) return topics;
  const bool is_there = std::any_of(
      begin.connections().begin(), begin.connections().end(),
      [&](const BagConnection& connection) { return connection.topic == loops->second; });
  if (!is_there) loops->second = kNoTopic;
  return topics;
}

// Empty if none is read. A robot with eyes may know a place again at any time; a log of poses alone
// goes by other rules if it has loop closures (LogRun), so they must be named, or be there.
std::string LoopTopicOf(const LogOptions& options, const BagPlan& plan) {
  if (!options.loop_file.empty()) return "";
  if (const auto named = options.topics.find(kLoopChannel); named != options.topics.end()) {
    return named->second == kNoTopic ? "" : named->second;
  }
  return plan.rig.HasEyes() || HasUse(plan, TopicUse::kLoops) ? kLoopTopic : "";
}

// Loop closures of a file are known at once and wait for their stamps; those of a topic come when
// they were recorded.
absl::Status PlanFollowedLoops(const LogOptions& options, BagPlan* plan, BagGrowth* growth,
                               LogDigest* digest, LogInfo* info) {
  growth->loop_topic = LoopTopicOf(options, *plan);
  if (!growth->loop_topic.empty()) info->channel_counts[kLoopChannel] = 0;
  if (options.loop_file.empty()) return absl::OkStatus();
  for (BagTopic& topic : plan->topics) {
    if (topic.use == TopicUse::kLoops) topic.use = TopicUse::kNone;
  }
  DSG_ASSIGN_OR_RETURN(const std::optional<SensorChannel> loops,
                       ReadLoopChannel(options, /*log_path=*/"", digest, info));
  for (size_t i = 0; i < loops->times.size(); ++i) {
    DSG_ASSIGN_OR_RETURN(Measurement loop, loops->make(i));
    growth->loops.Add(std::get<LoopMeasurement>(std::move(loop)));
  }
  Count(kLoopChannel, loops->times.size(), info);
  return absl::OkStatus();
}

}  // namespace

OpenedLog OpenBag(const std::string& path, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Bag> bag, OpenBagFiles(path));
  DSG_ASSIGN_OR_RETURN(BagPlan plan, PlanBag(*bag, options.topics));
  plan.is_strict = options.is_strict;
  LogInfo info = InfoOf(*bag, plan);
  LogDigest digest;
  DSG_ASSIGN_OR_RETURN(BagPoses poses, PlanPoses(*bag, options, &plan, &digest, &info));
  // While it still says which topic has the loop closures.
  AddBagContent(*bag, plan, options.pose_file.empty() ? poses.table : std::nullopt, options.on_pass,
                &digest);
  DSG_ASSIGN_OR_RETURN(std::optional<SensorChannel> loops,
                       ReadLoops(*bag, options, &plan, &digest, &info));
  info.content_sha256 = digest.Hex();
  CountTopics(plan, &info);
  std::vector<SensorChannel> known;
  if (poses.table.has_value()) {
    known.push_back(MakePoseChannel(*std::move(poses.table)));
    StampSpan span;
    for (const TimeNs time_ns : known.back().times) span.Add(time_ns);
    DSG_RETURN_IF_ERROR(CheckSharesTime(options, span, path, SensorSpan(*bag, plan)));
  }
  if (loops.has_value()) known.push_back(*std::move(loops));
  for (const SensorChannel& channel : known) Count(channel.name, channel.times.size(), &info);
  auto log = std::make_unique<BagStream>(std::move(bag), std::move(plan), RobotName(options),
                                         std::move(info));
  for (SensorChannel& channel : known) log->AddKnown(std::move(channel));
  DSG_RETURN_IF_ERROR(log->FindFirst());
  return std::unique_ptr<LogSource>(std::move(log));
}

OpenedLog OpenFollowedBag(std::unique_ptr<GrowingFile> file, const LogOptions& options) {
  BagGrowth growth;
  growth.late_ns = options.follow->late_ns;
  DSG_ASSIGN_OR_RETURN(growth.bag, GrowingBag::Open(std::move(file)));
  DSG_ASSIGN_OR_RETURN(const size_t message_count, growth.bag->WaitForBegin(kFollowedBeginNs));
  const BagBegin begin(*growth.bag->bag(), message_count);
  DSG_ASSIGN_OR_RETURN(BagPlan plan, PlanBag(begin, TopicsOfBegin(begin, options)));
  plan.is_strict = options.is_strict;
  LogInfo info = InfoOf(begin, plan);
  info.notes.push_back("the log is followed: it is committed while it grows");
  LogDigest digest;
  DSG_ASSIGN_OR_RETURN(BagPoses poses, PlanPoses(begin, options, &plan, &digest, &info));
  growth.transforms = std::move(poses.followed);
  DSG_RETURN_IF_ERROR(PlanFollowedLoops(options, &plan, &growth, &digest, &info));
  AddBagContent(begin, plan, poses.table, options.on_pass, &digest);
  // A bag of the same first seconds that is taken as a whole is another session. The number is that
  // of how a followed bag is cut into deltas: a run must not go on behind one that cut otherwise.
  digest.AddSize("followed", 1);
  info.content_sha256 = digest.Hex();
  CountTopics(plan, &info);
  if (poses.table.has_value()) Count(kPoseChannel, poses.table->rows.size(), &info);
  auto log = std::make_unique<BagStream>(std::move(growth), std::move(plan), RobotName(options),
                                         std::move(info));
  DSG_RETURN_IF_ERROR(log->FindFirst());
  return std::unique_ptr<LogSource>(std::move(log));
}

}  // namespace dsg::ingest
