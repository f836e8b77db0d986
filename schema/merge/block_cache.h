// SPDX-License-Identifier: Apache-2.0
// The last few mesh blocks that were read from a map.
// Refuses to keep more than its bound, whatever is asked.
#pragma once

#include <list>
#include <map>
#include <memory>

#include "absl/status/statusor.h"
#include "schema/model/geometry.h"
#include "schema/store/snapshot.h"

namespace dsg::merge {

/// Threads: one caller at a time.
class BlockCache {
 public:
  /// Blocks come carried by `map_T_stored`.
  BlockCache(std::shared_ptr<const Snapshot> map, const Pose3d& map_T_stored, size_t count_max)
      : map_(std::move(map)), map_T_stored_(map_T_stored), count_max_(count_max) {}

  absl::StatusOr<std::shared_ptr<const MeshBlock>> Read(BlockIndex index);

  /// From now on this block is read from `map`, and the others from where they were.
  void ReadAnew(BlockIndex index, std::shared_ptr<const Snapshot> map);

 private:
  using Entry = std::pair<BlockIndex, std::shared_ptr<const MeshBlock>>;

  std::shared_ptr<const Snapshot> map_;
  std::map<BlockIndex, std::shared_ptr<const Snapshot>> read_anew_;
  Pose3d map_T_stored_;
  size_t count_max_;
  /// Newest first.
  std::list<Entry> entries_;
  std::map<BlockIndex, std::list<Entry>::iterator> by_index_;
};

}  // namespace dsg::merge
