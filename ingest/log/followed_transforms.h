// SPDX-License-Identifier: Apache-2.0
// The poses that /tf of a followed bag gives: what they wait for, and for how long.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ingest/log/bag_transforms.h"
#include "ingest/log/body_track.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// What has been measured waits for transforms of its time and later ones until others are later by
/// so much, or so many measurements wait.
inline constexpr TimeNs kTransformWaitNs = 10 * kNsPerSecond;
inline constexpr size_t kTransformWaitingMax = 20'000;

/// Which frames lead from the robot's body to the root is known from the begin of the bag
/// (kFollowedBeginNs); what contradicts it later is an error, as in a bag that is read as a whole.
///
/// A pose is left out, and counted, when the transforms above it do not come within
/// kTransformWaitNs, and when it comes later than that itself. If a frame has not moved so far, it
/// is taken to stand after that time. Memory: of BodyTrack with kTransformWaitingMax.
/// Threads: one caller at a time.
class FollowedTransforms {
 public:
  /// `begin`: the transforms of the begin. nullopt if they place no body.
  /// Errors: of TransformTree::BodyChain.
  static absl::StatusOr<std::optional<FollowedTransforms>> Make(TransformTree begin);

  /// Takes a message of /tf.
  /// Errors: FILE_MALFORMED naming topic and message when it does not parse, or there are too many
  /// frames; of TransformTree::BodyChain and BodyTrack::Add.
  absl::Status Take(const RosBytes& message, const std::string& origin);

  /// The next pose that waits for nothing, or no longer. `now_ns`: the latest stamp of the log.
  std::optional<BodyPose> Next(TimeNs now_ns);
  /// The next pose: the log has ended, and what was above it stands.
  std::optional<BodyPose> NextAtEnd() { return track_.NextAtEnd(); }
  /// What comes for poses before `time_ns` from now on is too late.
  void SkipBefore(TimeNs time_ns) { track_.SkipBefore(time_ns); }

  /// Whether something of that stamp need not wait for poses. `waiting_count`: of what waits.
  bool IsSettled(TimeNs time_ns, TimeNs now_ns, size_t waiting_count) const;
  /// The latest stamp of a pose; kTimeMin before the first one.
  TimeNs newest_ns() const { return track_.newest_ns(); }

  /// A sentence once the root has come to be in another frame; empty before.
  std::string LateRootNote() const;
  /// What was left out and assumed, once the log has ended.
  void AddNotes(std::vector<std::string>* notes) const;

 private:
  FollowedTransforms(TransformTree tree, BodyTrack track);

  absl::Status CheckChain(const RosPose& transform);

  TransformTree tree_;
  BodyTrack track_;
  /// Parents of the frames of the chain; of the root none.
  std::map<std::string, std::string> parent_of_;
  /// In which frame the root is by now; empty = in none.
  std::string late_root_;
};

}  // namespace dsg::ingest
