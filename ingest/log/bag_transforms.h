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
#include "ingest/log/body_track.h"
#include "ingest/log/log_source.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// Whether messages of a connection are transforms that may move.
bool IsMovingTransforms(const BagConnection& connection);
/// Whether a bag has some.
bool HasMovingTransforms(const Bag& bag);

/// Every frame with its parent. Names are without a leading slash.
class TransformTree {
 public:
  /// Reads /tf_static, and /tf too if `with_moving`: that takes a pass over the bag. Transforms of
  /// /tf that are no pose are passed over. `on_read` (may be empty): of ReadPoses.
  /// Errors: FILE_MALFORMED naming topic and message, when one is no transform, or there are more
  /// than 10000 frames.
  static absl::StatusOr<TransformTree> Read(const Bag& bag, bool with_moving,
                                            const PassCallback& on_read = {});

  /// Takes a transform of /tf that comes later. Errors: of Read.
  absl::Status Add(const RosPose& transform, const std::string& origin) {
    return Add(transform, /*is_static=*/false, origin);
  }

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
  /// The same from a given frame. Errors: of BodyChain.
  absl::StatusOr<std::vector<std::string>> ChainFrom(const std::string& body) const;

  /// Which frames of the body's chain have a track.
  enum class Tracks {
    /// Those that move, or if none does, those that come with /tf: of a whole bag.
    kMoving,
    /// All that come with /tf, since they may move yet: of the begin of a bag.
    kAnyDynamic,
  };
  /// Makes the poses of BodyChain out of transforms: its driver is the lowest frame that moves, or
  /// if none does, that comes with /tf. nullopt if there is no chain. Errors: of BodyChain.
  absl::StatusOr<std::optional<BodyTrack>> MakeTrack(Tracks tracks,
                                                     size_t waiting_max = SIZE_MAX) const;

  /// The poses of the body as its track makes them. Transforms that are passed over are counted in
  /// `notes`. `on_read` (may be empty) gets the count of messages that were looked at, and of how
  /// many. nullopt if there is no chain. Requires: read with_moving, from this bag. Errors: of
  /// BodyChain and of BodyTrack::Add.
  absl::StatusOr<std::optional<TrackTable>> ReadPoses(const Bag& bag, const std::string& robot_name,
                                                      std::vector<std::string>* notes,
                                                      const PassCallback& on_read = {}) const;

 private:
  struct Edge {
    std::string parent;
    /// A parent that a later transform names.
    std::string other_parent;
    /// Of /tf_static the last, of /tf the first.
    Pose3d parent_T_child;
    /// Came with /tf, and more than once.
    bool is_dynamic = false;
    bool is_repeated = false;
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

/// "3 transforms of /tf are no pose, ..."; nothing if none is.
void NotePassedOver(int64_t count, std::vector<std::string>* notes);

}  // namespace dsg::ingest
