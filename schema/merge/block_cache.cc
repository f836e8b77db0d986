// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/block_cache.h"

#include <utility>

#include "schema/base/status.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {

absl::StatusOr<std::shared_ptr<const MeshBlock>> BlockCache::Read(BlockIndex index) {
  const auto found = by_index_.find(index);
  if (found != by_index_.end()) {
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().second;
  }
  const auto anew = read_anew_.find(index);
  const Snapshot& map = anew == read_anew_.end() ? *map_ : *anew->second;
  DSG_ASSIGN_OR_RETURN(MeshBlock block, map.ReadMeshBlock(index));
  TransformMesh(map_T_stored_, &block);
  entries_.emplace_front(index, std::make_shared<const MeshBlock>(std::move(block)));
  by_index_[index] = entries_.begin();
  if (entries_.size() > count_max_) {
    by_index_.erase(entries_.back().first);
    entries_.pop_back();
  }
  return entries_.front().second;
}

void BlockCache::ReadAnew(BlockIndex index, std::shared_ptr<const Snapshot> map) {
  read_anew_[index] = std::move(map);
  const auto found = by_index_.find(index);
  if (found == by_index_.end()) return;
  entries_.erase(found->second);
  by_index_.erase(found);
}

}  // namespace dsg::merge
