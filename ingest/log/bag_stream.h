// SPDX-License-Identifier: Apache-2.0
// The messages of a bag as measurements in the order of their stamps.
// Refuses stamps that step back within a topic, or between topics by more than a second, of a bag
// that is followed FollowOptions::late_ns.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/bag_measurement.h"
#include "ingest/log/bag_topics.h"
#include "ingest/log/followed_transforms.h"
#include "ingest/log/growing_bag.h"
#include "ingest/log/log_source.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/sensor_log.h"

namespace dsg::ingest {

/// What a bag that is still written brings besides its topics.
struct BagGrowth {
  std::unique_ptr<GrowingBag> bag;
  /// Set if /tf gives the poses.
  std::optional<FollowedTransforms> transforms;
  /// Those of LogOptions::loop_file.
  LoopQueue loops;
  /// The topic of loop closures, which may come later than the others; empty = none is read.
  std::string loop_topic;
  /// FollowOptions::late_ns.
  TimeNs late_ns = kNsPerSecond;
};

/// A bag without anything usable can be made a stream, so that its notes can be read; its first
/// Next() fails.
///
/// Topics are recorded when they arrive, which is a little after their stamps and not all alike:
/// what a topic has waits until another one is a second (late_ns) later. Of a bag that is still
/// written it also waits for the transforms around it (FollowedTransforms); a loop closure waits
/// until what is as late as its later stamp has come. What comes when depends on the bag only, not
/// on how much of it was there when.
class BagStream : public LogSource {
 public:
  /// A bag that is there as a whole.
  BagStream(std::shared_ptr<const Bag> bag, BagPlan plan, const std::string& robot_name,
            LogInfo info);
  /// One that is still written. `plan` is that of its begin.
  BagStream(BagGrowth growth, BagPlan plan, const std::string& robot_name, LogInfo info);

  /// What is known as a whole before the bag is read: poses and loop closures.
  void AddKnown(SensorChannel channel);
  /// Reads until the first measurement is known, and sets the begin of the log.
  /// Errors: of Next.
  absl::Status FindFirst();

  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override;
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming topic, message and stamps; of GrowingBag::Wait.
  absl::StatusOr<std::optional<Measurement>> Next() override;

 private:
  struct Known {
    SensorChannel channel;
    size_t next = 0;

    bool IsAtEnd() const { return next == channel.times.size(); }
    std::pair<TimeNs, ChannelRank> key() const { return {channel.times[next], channel.rank}; }
  };
  struct Key {
    TimeNs time_ns = 0;
    ChannelRank rank = ChannelRank::kImages;
    std::string channel;
    int64_t sequence = 0;

    auto operator<=>(const Key&) const = default;
  };

  Known* FirstKnown();
  bool IsLoopNext() const;
  absl::Status NothingUsable() const;
  absl::Status Malformed(size_t topic, const std::string& message) const;

  bool IsStopped() const { return growth_.bag != nullptr && growth_.bag->file().IsStopped(); }
  bool IsOfOneSource() const;
  bool HasNext() const;
  absl::StatusOr<bool> HasMore();
  void EndGrowth();
  void PlanLateConnections();

  absl::Status Fill();
  absl::Status TakeMessage(const BagMessageRef& ref);
  absl::Status TakeLoop(const BagMessageRef& ref, size_t index);
  absl::Status TakeTransforms(const BagMessageRef& ref, size_t index);
  void TakePoses();
  void AddPose(const BodyPose& pose);
  absl::Status CheckOrder(const Key& key, size_t index);

  LogInfo info_;
  bool is_usable_;
  std::shared_ptr<const Bag> bag_;
  /// Without a bag if it is there as a whole.
  BagGrowth growth_;
  bool is_ended_ = false;
  std::vector<std::string> late_topics_;
  BagPlan plan_;
  BagMeasurements measurements_;
  LoopLines loop_lines_;
  std::vector<Known> known_;
  size_t next_ = 0;
  /// By topic: messages seen, and the last one's key.
  std::vector<int64_t> numbers_;
  std::vector<std::optional<Key>> last_;
  int64_t transform_pose_count_ = 0;
  TimeNs latest_ns_ = 0;
  TimeNs emitted_ns_ = 0;
  std::map<Key, Measurement> waiting_;
};

}  // namespace dsg::ingest
