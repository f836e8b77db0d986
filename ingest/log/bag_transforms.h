// SPDX-License-Identifier: Apache-2.0
// The transforms of a bag (/tf, /tf_static): where sensors sit on the robot, and where the robot
// is.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// Whether a bag has transforms that may move.
bool HasMovingTransforms(const Bag& bag);

/// Every frame with its parent. Names are without a leading slash.
class TransformTree {
 public:
  /// Reads /tf_static, and /tf too if `with_moving`: that takes a pass over the bag. Transforms of
  /// /tf that are no pose are passed over.
  /// Errors: FILE_MALFORMED naming topic and message, when one is no transform, or there are more
  /// than 10000 frames.
  static absl::StatusOr<TransformTree> Read(const Bag& bag, bool with_moving);

  /// Where a sensor's frame is on the robot: from the nearest frame above it that is one of the
  /// robot's body (base_link_gt, base_link, imu, imu0, base_footprint), by transforms that do not
  /// move. nullopt if there is none.
  std::optional<Pose3d> BodyTFrame(const std::string& frame) const;

  /// The frames from the robot's body up to the root; empty if there are none. The body is the
  /// first of the names above that moves, else the only frame that moves, else the first of the
  /// names of which /tf says where it stands.
  /// Errors: FILE_MALFORMED naming the frames when they run in a circle, or one of them has two
  /// parents.
  absl::StatusOr<std::vector<std::string>> BodyChain() const;

  /// The poses of the body in the root of its chain, one per transform of the lowest frame that
  /// moves (if none does, of which /tf says where it stands); what is above is interpolated. A
  /// transform that is no pose, or whose stamp is not after that of the one before, is passed over,
  /// and counted in `notes` unless it says the same. nullopt if there is no chain. Requires: read
  /// with_moving, from this bag. Errors: of BodyChain.
  absl::StatusOr<std::optional<TrackTable>> ReadPoses(const Bag& bag, const std::string& robot_name,
                                                      std::vector<std::string>* notes) const;

 private:
  struct Edge {
    std::string parent;
    /// A parent that a later transform names.
    std::string other_parent;
    /// Of /tf_static the last, of /tf the first.
    Pose3d parent_T_child;
    /// Came with /tf.
    bool is_dynamic = false;
    /// And said different things.
    bool is_moving = false;
  };

  absl::Status Add(const RosPose& transform, bool is_static, const std::string& origin);
  /// Whether the flag is set of the frame or of one above it.
  bool Has(bool Edge::*flag, const std::string& frame) const;
  std::string FindBody() const;

  std::string path_;
  /// By child.
  std::map<std::string, Edge> edges_;
};

}  // namespace dsg::ingest
