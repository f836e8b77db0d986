// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/block_map.h"

#include <utility>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

// Labels grow in small steps: doubling would waste half of them on average.
constexpr size_t kLabelStep = 48;

uint64_t Pack(const BlockKey& key) {
  constexpr uint64_t kMask = (uint64_t{1} << 21) - 1;
  return (static_cast<uint64_t>(key.x) & kMask) | (static_cast<uint64_t>(key.y) & kMask) << 21 |
         (static_cast<uint64_t>(key.z) & kMask) << 42;
}

}  // namespace

VoxelLabels* VoxelBlock::MakeLabels(int index) {
  if (label_index.empty()) label_index.assign(kCount, kNoLabels);
  uint16_t& place = label_index[index];
  if (place == kNoLabels) {
    place = static_cast<uint16_t>(labels.size());
    if (labels.size() == labels.capacity()) labels.reserve(labels.size() + kLabelStep);
    labels.emplace_back();
  }
  return &labels[place];
}

void VoxelBlock::Clear() {
  voxels.fill(Voxel());
  label_index.clear();
  labels.clear();
  first_seen_ns = first_surface_ns = kTimeMax;
  last_seen_ns = last_surface_ns = kTimeMin;
  updated = has_surface = queued = label_changed = false;
}

VoxelBlock* BlockMap::Find(const BlockKey& key) const {
  const auto found = by_key_.find(Pack(key));
  return found == by_key_.end() ? nullptr : found->second;
}

void BlockMap::Insert(std::unique_ptr<VoxelBlock> block) {
  const bool is_new = by_key_.emplace(Pack(block->key), block.get()).second;
  DSG_CHECK(is_new);
  blocks_.push_back(std::move(block));
}

}  // namespace dsg::ingest
