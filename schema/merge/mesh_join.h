// SPDX-License-Identifier: Apache-2.0
// Copies the mesh of another map into this one, without a second layer where both have the surface.
// Does not weld: surfaces that meet end side by side.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/model/mesh.h"
#include "schema/store/snapshot.h"

namespace dsg::merge {

struct MeshJoinOptions {
  /// A vertex of the other map this near to a surface of this one, with a normal alike, is that
  /// surface: noise of both maps, and what the transform misses.
  double near_m = 0.12;
  /// Along the surface: vertices are this far apart at most.
  double along_m = 0.15;
  double normal_angle_max_rad = 1.0;
};

struct MeshIds {
  /// From the other map's numbers to ours; what is missing becomes 0.
  std::map<uint32_t, uint32_t> label_of;
  std::map<uint32_t, uint32_t> instance_of;
};

/// Threads: one caller at a time. Reads blocks as they are needed and keeps a few.
class MeshJoin {
 public:
  MeshJoin(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other,
           const Pose3d& map_T_other, MeshIds ids, const MeshJoinOptions& options);
  ~MeshJoin();

  /// The next block that changes; nullopt at the end. Faces of the other map are left out where all
  /// their vertices are near a surface of this one; then the surface was seen again: its last_seen
  /// grows, and where it had no instance it takes theirs.
  /// Order: ascending index.
  absl::StatusOr<std::optional<MeshBlock>> Next(const StopCheck& stop);
  /// Others have written or removed these blocks of `into`: they are taken from `head`. All others
  /// stay as they were, for what Next gave must not be met again as a surface of this map.
  absl::Status Follow(const std::shared_ptr<const Snapshot>& head,
                      const std::vector<BlockIndex>& touched);
  /// Of the blocks that the other map touches, how many are done.
  double progress() const;
  /// Blocks so far that both maps had.
  int64_t fused_block_count() const;
  /// Faces of the other map so far, and those of them that were left out.
  int64_t face_count() const;
  int64_t dropped_face_count() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::merge
