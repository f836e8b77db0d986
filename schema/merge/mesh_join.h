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
  /// A vertex of the other map lies on a surface of this map within this distance across it. Covers
  /// the noise of both maps and the error of the transform.
  double near_m = 0.12;
  /// The same along the surface, where vertices lie apart.
  double along_m = 0.15;
  double normal_angle_max_rad = 1.0;
};

struct MeshIds {
  /// From numbers of the other map to numbers here; missing ones become 0.
  std::map<uint32_t, uint32_t> label_of;
  std::map<uint32_t, uint32_t> instance_of;
};

/// Reads blocks on demand and caches a few. Threads: one caller at a time.
class MeshJoin {
 public:
  MeshJoin(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other,
           const Pose3d& map_T_other, MeshIds ids, const MeshJoinOptions& options);
  ~MeshJoin();

  /// The next block that changes; nullopt at the end. A face of the other map is dropped if all its
  /// vertices lie on a surface of this map; that surface was seen again, so its last_seen grows,
  /// and it takes the instance of the face if it had none.
  /// Order: ascending index.
  absl::StatusOr<std::optional<MeshBlock>> Next(const StopCheck& stop);
  /// Others have written or removed these blocks of `into`, so they are read from `head`. The other
  /// blocks are still read from `into`: what Next returned must not count as a surface of this map.
  absl::Status Follow(const std::shared_ptr<const Snapshot>& head,
                      const std::vector<BlockIndex>& touched);
  /// Share of the blocks that the other map touches that are done; 0 to 1.
  double progress() const;
  /// Blocks so far that both maps had.
  int64_t fused_block_count() const;
  /// Faces of the other map so far, and those of them that were dropped.
  int64_t face_count() const;
  int64_t dropped_face_count() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::merge
