// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/block_cache.h"

#include "schema/base/status.h"
#include "schema/merge/transform_node.h"

namespace dsg::merge {

absl::StatusOr<std::shared_ptr<const MeshBlock>> BlockCache::Read(BlockIndex index) {
  const auto found = by_index_.find(index);
  if (found != by_index_.end()) {
    entries_.splice(entries_.begin(), entries_, found->second);
    return entries_.front().second;
  }
  DSG_ASSIGN_OR_RETURN(MeshBlock block, map_->ReadMeshBlock(index));
  TransformMesh(map_T_stored_, &block);
  entries_.emplace_front(index, std::make_shared<const MeshBlock>(std::move(block)));
  by_index_[index] = entries_.begin();
  if (entries_.size() > count_max_) {
    by_index_.erase(entries_.back().first);
    entries_.pop_back();
  }
  return entries_.front().second;
}

}  // namespace dsg::merge
