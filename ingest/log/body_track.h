// SPDX-License-Identifier: Apache-2.0
// Where the robot's body is, from transforms that come one after another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// The name of a frame without the leading slash that old publishers write.
std::string FrameName(const std::string& frame);
/// In quotes, fit for a terminal.
std::string ShownFrame(const std::string& frame);
/// Number by number.
bool IsSamePose(const Pose3d& a, const Pose3d& b);

/// A frame of the chain from the robot's body up to the root.
struct ChainFrame {
  std::string name;
  /// Empty for the root.
  std::string parent;
  /// Where a frame without a track stands.
  Pose3d parent_T_frame;
  /// Whether its transforms come over time.
  bool has_track = false;
  /// Whether more than one is known to come: then it is waited for from the first on.
  bool is_repeated = false;
};

/// Two publishers of one frame take turns; a clock that has jumped goes on.
inline constexpr int kStepsBackMax = 20;

struct BodyPose {
  TimeNs time_ns = 0;
  Pose3d root_T_body;
};

/// Poses of the body in the root of its chain, one per transform of one frame, the driver, in the
/// order of time. The other frames with tracks are interpolated between their neighbours; they
/// stand before their first transform and after their last.
///
/// A pose waits until each frame with a track has a transform of its stamp or a later one. A frame
/// of which one transform has come, and no more are known to, is not waited for.
///
/// Memory: transforms of the driver whose poses wait, and of the other frames those that poses to
/// come may need; `waiting_max` of each frame. Threads: one caller at a time.
class BodyTrack {
 public:
  /// `chain`: from the body up to the root. Requires: the driver has a track.
  BodyTrack(std::vector<ChainFrame> chain, size_t driver, size_t waiting_max = SIZE_MAX);

  const std::vector<ChainFrame>& chain() const { return chain_; }
  /// "/tf, frame "base_link" in "map"".
  std::string Name() const;

  /// Keeps a transform of a frame with a track. One that is no pose, or whose stamp is not after
  /// that of the one before, is passed over, and counted unless it says the same.
  /// Errors: FILE_MALFORMED when kStepsBackMax stamps of a frame in a row are before the one that
  /// was kept: that one, or these, are of a clock that jumped.
  absl::Status Add(const RosPose& transform, const std::string& origin);

  /// The next pose, if it waits for nothing. One up to `overdue_ns` does not wait for frames that
  /// have never moved.
  std::optional<BodyPose> Next(TimeNs overdue_ns = kTimeMin);
  /// The next pose, if there is one: no more transforms will come.
  std::optional<BodyPose> NextAtEnd();
  /// Gives up poses before `time_ns`: those that wait, and those that come later.
  void SkipBefore(TimeNs time_ns);

  /// Next gives all poses up to here without waiting; kTimeMin before the driver's first transform.
  TimeNs known_ns() const;
  /// The latest stamp of the driver; kTimeMin before its first transform.
  TimeNs newest_ns() const;
  size_t waiting_count() const { return links_[driver_].samples.size(); }
  int64_t passed_over_count() const { return passed_over_count_; }
  /// Given up while they waited, and because they came too late.
  int64_t skipped_count() const { return skipped_count_; }
  int64_t late_count() const { return late_count_; }

 private:
  struct Sample {
    TimeNs time_ns = 0;
    Pose3d parent_T_frame;
  };
  /// What is known of a frame over time.
  struct Link {
    std::deque<Sample> samples;
    std::optional<Sample> last;
    std::string last_origin;
    /// Stamps in a row before the last one's.
    int steps_back = 0;
    /// More than one transform is known to come; they have differed.
    bool is_repeated = false;
    bool has_moved = false;

    /// Whether a pose of that stamp waits for it.
    bool IsWaitedFor(TimeNs time_ns) const { return is_repeated && last_ns() < time_ns; }
    TimeNs last_ns() const { return last.has_value() ? last->time_ns : kTimeMin; }
    Pose3d At(TimeNs time_ns) const;
    void ForgetBefore(TimeNs time_ns);
  };

  absl::Status ClockJumped(const Link& link, const std::string& frame, TimeNs time_ns,
                           const std::string& origin) const;
  bool Keep(const Sample& sample, Link* link);
  BodyPose Take();
  void ForgetAbove(TimeNs time_ns);

  std::vector<ChainFrame> chain_;
  /// By frame of the chain.
  std::vector<Link> links_;
  size_t driver_;
  size_t waiting_max_;
  /// Poses before it are given up.
  TimeNs floor_ns_ = kTimeMin;
  int64_t passed_over_count_ = 0;
  int64_t skipped_count_ = 0;
  int64_t late_count_ = 0;
};

}  // namespace dsg::ingest
