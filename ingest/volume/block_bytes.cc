// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/block_bytes.h"

#include <cstddef>
#include <cstring>
#include <type_traits>

namespace dsg::ingest {
namespace {

// A voxel without the room behind its last member.
constexpr size_t kVoxelBytes = offsetof(Voxel, published) + sizeof(Voxel::published);
static_assert(std::is_trivially_copyable_v<Voxel> && kVoxelBytes == 14);
static_assert(std::has_unique_object_representations_v<VoxelLabels>);

struct Head {
  TimeNs first_seen_ns;
  TimeNs last_seen_ns;
  TimeNs first_surface_ns;
  TimeNs last_surface_ns;
  uint32_t index_count;
  uint32_t label_count;
  /// Bits, in the order of the members of VoxelBlock.
  uint64_t flags;
};
static_assert(std::has_unique_object_representations_v<Head>);

constexpr size_t kVoxelsEnd = sizeof(Head) + kVoxelBytes * VoxelBlock::kCount;

}  // namespace

std::string EncodeBlock(const VoxelBlock& block) {
  const Head head{block.first_seen_ns,
                  block.last_seen_ns,
                  block.first_surface_ns,
                  block.last_surface_ns,
                  static_cast<uint32_t>(block.label_index.size()),
                  static_cast<uint32_t>(block.labels.size()),
                  uint64_t{block.updated} | uint64_t{block.has_surface} << 1 |
                      uint64_t{block.queued} << 2 | uint64_t{block.label_changed} << 3};
  const size_t index_bytes = block.label_index.size() * sizeof(uint16_t);
  const size_t label_bytes = block.labels.size() * sizeof(VoxelLabels);
  std::string bytes(kVoxelsEnd + index_bytes + label_bytes, '\0');
  char* out = bytes.data();
  std::memcpy(out, &head, sizeof(head));
  out += sizeof(head);
  for (const Voxel& voxel : block.voxels) {
    std::memcpy(out, &voxel, kVoxelBytes);
    out += kVoxelBytes;
  }
  if (index_bytes > 0) std::memcpy(out, block.label_index.data(), index_bytes);
  if (label_bytes > 0) std::memcpy(out + index_bytes, block.labels.data(), label_bytes);
  return bytes;
}

bool DecodeBlock(std::string_view bytes, VoxelBlock* block) {
  if (bytes.size() < kVoxelsEnd) return false;
  Head head;
  std::memcpy(&head, bytes.data(), sizeof(head));
  const bool has_index = head.index_count == VoxelBlock::kCount;
  if (!has_index && head.index_count != 0) return false;
  if (head.label_count > head.index_count) return false;
  const size_t index_bytes = head.index_count * sizeof(uint16_t);
  const size_t label_bytes = head.label_count * sizeof(VoxelLabels);
  if (bytes.size() != kVoxelsEnd + index_bytes + label_bytes) return false;
  block->first_seen_ns = head.first_seen_ns;
  block->last_seen_ns = head.last_seen_ns;
  block->first_surface_ns = head.first_surface_ns;
  block->last_surface_ns = head.last_surface_ns;
  block->updated = (head.flags & 1) != 0;
  block->has_surface = (head.flags & 2) != 0;
  block->queued = (head.flags & 4) != 0;
  block->label_changed = (head.flags & 8) != 0;
  const char* in = bytes.data() + sizeof(head);
  for (Voxel& voxel : block->voxels) {
    std::memcpy(static_cast<void*>(&voxel), in, kVoxelBytes);
    in += kVoxelBytes;
  }
  block->label_index.resize(head.index_count);
  if (index_bytes > 0) std::memcpy(block->label_index.data(), in, index_bytes);
  block->labels.resize(head.label_count);
  if (label_bytes > 0) {
    std::memcpy(static_cast<void*>(block->labels.data()), in + index_bytes, label_bytes);
  }
  for (const uint16_t place : block->label_index) {
    if (place != VoxelBlock::kNoLabels && place >= head.label_count) return false;
  }
  return true;
}

}  // namespace dsg::ingest
