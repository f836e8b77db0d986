// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_stream.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/bag_transforms.h"
#include "ingest/log/followed_log.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Far more than a second of any rig; stamps that all are equal must not fill the memory.
constexpr size_t kWaitingMax = 200'000;
static_assert(kTransformWaitingMax < kWaitingMax);

}  // namespace

BagStream::BagStream(std::shared_ptr<const Bag> bag, BagPlan plan, const std::string& robot_name,
                     LogInfo info)
    : info_(std::move(info)),
      is_usable_(info_.measurement_count > 0),
      bag_(std::move(bag)),
      plan_(std::move(plan)),
      measurements_(bag_, plan_, robot_name),
      numbers_(plan_.topics.size(), 0),
      last_(plan_.topics.size()) {}

BagStream::BagStream(BagGrowth growth, BagPlan plan, const std::string& robot_name, LogInfo info)
    : BagStream(growth.bag->bag(), std::move(plan), robot_name, std::move(info)) {
  growth_ = std::move(growth);
  // Nobody knows how many there will be.
  info_.measurement_count = 0;
}

void BagStream::SetIdle(std::function<absl::Status()> idle) {
  if (growth_.bag != nullptr) growth_.bag->file().SetIdle(std::move(idle));
}

void BagStream::AddKnown(SensorChannel channel) {
  known_.push_back({std::move(channel)});
  is_usable_ = true;
}

absl::Status BagStream::FindFirst() {
  DSG_RETURN_IF_ERROR(Fill());
  TimeNs first_ns = waiting_.empty() ? kTimeMax : waiting_.begin()->first.time_ns;
  for (const Known& known : known_) {
    // A stray stamp of a loop closure must not give a map its epoch.
    if (known.IsAtEnd() || known.channel.rank == ChannelRank::kLoops) continue;
    first_ns = std::min(first_ns, known.key().first);
  }
  if (first_ns == kTimeMax) first_ns = 0;
  info_.first_ns = first_ns;
  info_.clock = ClockOf(first_ns);
  return absl::OkStatus();
}

absl::StatusOr<std::optional<Measurement>> BagStream::Next() {
  if (!is_usable_) return NothingUsable();
  DSG_RETURN_IF_ERROR(Fill());
  // What could still be overtaken is read again when the log is taken up again.
  if (IsStopped() && !IsOfOneSource()) return std::nullopt;
  Known* const known = FirstKnown();
  if (known != nullptr &&
      (waiting_.empty() ||
       known->key() < std::pair(waiting_.begin()->first.time_ns, waiting_.begin()->first.rank))) {
    DSG_ASSIGN_OR_RETURN(Measurement measurement, known->channel.make(known->next++));
    return measurement;
  }
  if (IsLoopNext()) return Measurement(growth_.loops.Take());
  if (waiting_.empty()) return std::nullopt;
  auto first = waiting_.extract(waiting_.begin());
  emitted_ns_ = first.key().time_ns;
  if (growth_.transforms.has_value()) growth_.transforms->SkipBefore(emitted_ns_);
  return std::move(first.mapped());
}

BagStream::Known* BagStream::FirstKnown() {
  Known* first = nullptr;
  for (Known& known : known_) {
    if (known.IsAtEnd()) continue;
    if (first == nullptr || known.key() < first->key()) first = &known;
  }
  return first;
}

// Behind everything of its later stamp.
bool BagStream::IsLoopNext() const {
  if (growth_.loops.empty()) return false;
  return waiting_.empty() || growth_.loops.first_ns() < waiting_.begin()->first.time_ns;
}

absl::Status BagStream::NothingUsable() const {
  std::vector<const BagTopic*> topics;
  for (const BagTopic& topic : plan_.topics) topics.push_back(&topic);
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(info_.path, ": the bag holds no topic that can be used; it has: ",
                                TopicNames(topics), "; see docs/sensor_logs.md"),
                   {{"file", info_.path}});
}

absl::Status BagStream::Malformed(size_t topic, const std::string& message) const {
  return MakeError(
      Reason::kFileMalformed,
      absl::StrCat(BagOrigin(*bag_, plan_.topics[topic].name, numbers_[topic]), " ", message),
      {{"file", bag_->path()}, {"topic", plan_.topics[topic].name}});
}

// Then nothing can be overtaken.
bool BagStream::IsOfOneSource() const {
  if (!growth_.loops.empty() || !growth_.loop_topic.empty()) return false;
  const auto topic_count =
      std::count_if(plan_.topics.begin(), plan_.topics.end(),
                    [](const BagTopic& topic) { return topic.use != TopicUse::kNone; });
  return topic_count + (growth_.transforms.has_value() ? 1 : 0) == 1;
}

// Whether what comes first can no longer be overtaken.
bool BagStream::HasNext() const {
  if (waiting_.empty()) return false;
  const TimeNs first_ns = waiting_.begin()->first.time_ns;
  if (growth_.transforms.has_value() &&
      !growth_.transforms->IsSettled(first_ns, latest_ns_, waiting_.size())) {
    return false;
  }
  return latest_ns_ - first_ns >= growth_.late_ns || (growth_.bag != nullptr && IsOfOneSource());
}

// Whether there are messages that were not taken.
absl::StatusOr<bool> BagStream::HasMore() {
  if (next_ < bag_->messages().size()) return true;
  if (growth_.bag == nullptr || is_ended_) return false;
  DSG_ASSIGN_OR_RETURN(const bool has_more, growth_.bag->Wait());
  if (!has_more) EndGrowth();
  return has_more;
}

void BagStream::EndGrowth() {
  is_ended_ = true;
  if (growth_.transforms.has_value()) {
    // In a bag without its end a transform may be missing that moves them.
    if (growth_.bag->bag()->is_closed()) {
      while (const auto pose = growth_.transforms->NextAtEnd()) AddPose(*pose);
    }
    growth_.transforms->AddNotes(&info_.notes);
  }
  loop_lines_.NoteKeys(&info_.notes);
  const std::string rest = growth_.bag->RestNote();
  if (!rest.empty()) info_.notes.push_back(rest);
  if (late_topics_.empty()) return;
  info_.notes.push_back(absl::StrCat(
      "topics that came later than ", kFollowedBeginNs / kNsPerSecond,
      " s after the first message and were not read: ", absl::StrJoin(late_topics_, ", ")));
}

// Gives the connections that are new a topic: that of their name, or none.
void BagStream::PlanLateConnections() {
  const std::vector<BagConnection>& connections = bag_->connections();
  for (size_t i = plan_.topic_of_connection.size(); i < connections.size(); ++i) {
    const auto same =
        std::find_if(plan_.topics.begin(), plan_.topics.end(), [&](const BagTopic& topic) {
          return topic.name == connections[i].topic && topic.type == connections[i].type;
        });
    plan_.topic_of_connection.push_back(static_cast<size_t>(same - plan_.topics.begin()));
    if (same != plan_.topics.end()) continue;
    BagTopic topic;
    topic.name = connections[i].topic;
    topic.type = connections[i].type;
    constexpr size_t kNamedMax = 20;
    if (!growth_.loop_topic.empty() && topic.name == growth_.loop_topic &&
        topic.type == kLoopType) {
      // A robot drives for a while before it knows a place again.
      topic.use = TopicUse::kLoops;
      topic.channel = kLoopChannel;
    } else if (late_topics_.size() < kNamedMax) {
      late_topics_.push_back(absl::Utf8SafeCHexEscape(topic.name.substr(0, 120)));
    }
    plan_.topics.push_back(std::move(topic));
    plan_.first_messages.emplace_back();
    numbers_.push_back(0);
    last_.emplace_back();
  }
}

// Until what comes first can no longer be overtaken.
absl::Status BagStream::Fill() {
  while (!HasNext()) {
    DSG_ASSIGN_OR_RETURN(const bool has_more, HasMore());
    if (!has_more) return absl::OkStatus();
    PlanLateConnections();
    const BagMessageRef ref = bag_->messages()[next_++];
    DSG_RETURN_IF_ERROR(TakeMessage(ref));
    TakePoses();
    if (waiting_.size() > kWaitingMax) {
      return Malformed(plan_.topic_of_connection[ref.connection],
                       absl::StrCat("more than ", kWaitingMax, " messages lie within ",
                                    static_cast<double>(growth_.late_ns) * 1e-9, " s"));
    }
  }
  return absl::OkStatus();
}

absl::Status BagStream::TakeMessage(const BagMessageRef& ref) {
  const size_t index = plan_.topic_of_connection[ref.connection];
  const BagTopic& topic = plan_.topics[index];
  if (growth_.transforms.has_value() && IsMovingTransforms(bag_->connections()[ref.connection])) {
    return TakeTransforms(ref, index);
  }
  if (topic.use == TopicUse::kNone) return absl::OkStatus();
  if (topic.use == TopicUse::kLoops) return TakeLoop(ref, index);
  DSG_ASSIGN_OR_RETURN(Measurement measurement, measurements_.Read(ref, topic, ++numbers_[index]));
  int64_t sequence = numbers_[index];
  if (const auto* detection = std::get_if<HumanDetection>(&measurement)) {
    sequence = detection->id;
  }
  Key key{StampOf(measurement), RankOf(topic.use), topic.channel, sequence};
  DSG_RETURN_IF_ERROR(CheckOrder(key, index));
  latest_ns_ = std::max(latest_ns_, key.time_ns);
  waiting_.emplace(std::move(key), std::move(measurement));
  return absl::OkStatus();
}

absl::Status BagStream::TakeLoop(const BagMessageRef& ref, size_t index) {
  const std::string origin = BagOrigin(*bag_, plan_.topics[index].name, ++numbers_[index]);
  DSG_ASSIGN_OR_RETURN(const BagMessage message, bag_->Read(ref));
  DSG_ASSIGN_OR_RETURN(const std::string_view text, ParseRosString(message.data, origin));
  DSG_ASSIGN_OR_RETURN(LoopMeasurement loop, loop_lines_.Read(LinePosition{origin, 1}, text));
  growth_.loops.Add(std::move(loop));
  return absl::OkStatus();
}

absl::Status BagStream::TakeTransforms(const BagMessageRef& ref, size_t index) {
  FollowedTransforms& transforms = *growth_.transforms;
  const std::string origin = BagOrigin(*bag_, plan_.topics[index].name, ++numbers_[index]);
  DSG_ASSIGN_OR_RETURN(const BagMessage message, bag_->Read(ref));
  const bool had_root = transforms.LateRootNote().empty();
  DSG_RETURN_IF_ERROR(transforms.Take(message.data, origin));
  if (had_root && !transforms.LateRootNote().empty()) {
    growth_.bag->file().Tell(transforms.LateRootNote());
  }
  latest_ns_ = std::max(latest_ns_, transforms.newest_ns());
  return absl::OkStatus();
}

// After each message: what others measured says how long a pose has waited.
void BagStream::TakePoses() {
  if (!growth_.transforms.has_value()) return;
  while (const auto pose = growth_.transforms->Next(latest_ns_)) AddPose(*pose);
}

void BagStream::AddPose(const BodyPose& pose) {
  const int64_t number = ++transform_pose_count_;
  waiting_.emplace(Key{pose.time_ns, ChannelRank::kPoses, kPoseChannel, number},
                   measurements_.MakePose(pose.time_ns, pose.root_T_body, number));
}

absl::Status BagStream::CheckOrder(const Key& key, size_t index) {
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
    return Malformed(index, absl::StrCat("has stamp ", key.time_ns, " after stamp ", last->time_ns,
                                         "; stamps must grow within a topic: sort or filter the "
                                         "bag"));
  }
  if (key.time_ns < emitted_ns_) {
    return Malformed(index,
                     absl::StrCat("has stamp ", key.time_ns, ", more than ",
                                  static_cast<double>(growth_.late_ns) * 1e-9, " s before stamp ",
                                  latest_ns_, " of another topic; do they share a clock?"));
  }
  last = key;
  return absl::OkStatus();
}

}  // namespace dsg::ingest
