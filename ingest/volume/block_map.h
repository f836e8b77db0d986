// SPDX-License-Identifier: Apache-2.0
// Finds voxel blocks by where they are, and holds them: in memory those in use, the rest on disk.
// Refuses to be walked in hash order: blocks have numbers in the order of their making.
#pragma once

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "ingest/files/spill_file.h"
#include "ingest/volume/spill_options.h"
#include "ingest/volume/voxel_block.h"

namespace dsg::ingest {

/// What a voxel says of the space that it is in.
enum class VoxelState : uint8_t {
  kUnseen,
  /// Nearer than half a voxel to a surface, or inside.
  kInside,
  /// Nearer than a voxel.
  kNear,
  kFree,
};

/// Blocks are read back when they are asked for. They go to disk in Trim alone, those that were not
/// asked for for longest: the robot is far from them. A block on disk takes 0.25 kB of memory, one
/// in memory 8 to 20 kB.
///
/// When the disk fails, a block that cannot be read comes as new, and status() says so: nothing
/// that was made of the blocks since then may be used.
///
/// Threads: reading from many; Trim, Insert and moving by one, and none meanwhile.
class BlockMap {
 public:
  /// Keys beyond this on an axis are refused by the callers.
  static constexpr int32_t kKeyMax = (1 << 20) - 2;

  explicit BlockMap(double voxel_m, const SpillOptions& spill = {});

  double voxel_m() const { return voxel_m_; }
  int64_t size() const { return static_cast<int64_t>(slots_.size()); }
  /// Requires: 0 <= number < size().
  VoxelBlock& block(int64_t number) { return *Use(slots_[number].get()); }
  const VoxelBlock& block(int64_t number) const { return *Use(slots_[number].get()); }
  const BlockKey& key(int64_t number) const { return slots_[number]->key; }
  /// The same, without reading the block from disk.
  bool HasSurface(int64_t number) const;
  using States = std::array<VoxelState, VoxelBlock::kCount>;
  States StatesOf(int64_t number) const;
  /// Of the voxel that holds the point; kUnseen where there is no block.
  VoxelState StateAt(const Eigen::Vector3d& point_map) const;

  /// Null when there is none.
  VoxelBlock* Find(const BlockKey& key) const;
  /// Requires: there is none of its key yet.
  void Insert(std::unique_ptr<VoxelBlock> block);

  /// If more blocks are in memory than there may be, writes those to disk that were not used for
  /// longest. Pointers and references to blocks are void afterwards.
  /// Errors: of SpillFile::Write; all blocks are as they were, in memory. The first error stays.
  absl::Status Trim() const;
  /// Whether Trim may have something to do.
  bool IsFull() const { return resident_count_ > resident_count_max_; }
  /// Whether any blocks may have to be on disk.
  bool IsLarge() const { return size() > resident_count_max_; }
  int64_t resident_count() const { return resident_count_; }
  const absl::Status& status() const { return status_; }
  /// A map of none, that keeps blocks as this one does.
  BlockMap MakeEmpty() const { return BlockMap(voxel_m_, spill_); }

  static BlockKey KeyOf(const Eigen::Vector3i& voxel) {
    return {voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3};
  }
  static int IndexOf(const Eigen::Vector3i& voxel) {
    return VoxelBlock::IndexOf(voxel.x() & 7, voxel.y() & 7, voxel.z() & 7);
  }
  /// The voxel that holds a point.
  Eigen::Vector3i VoxelOf(const Eigen::Vector3d& point_map) const {
    return (point_map / voxel_m_).array().floor().cast<int>();
  }

 private:
  struct Slot {
    BlockKey key;
    /// `block` is there to be read.
    std::atomic<bool> is_here = true;
    /// Of a block on disk.
    bool has_surface = false;
    /// Count of Trim when it was last used.
    std::atomic<uint32_t> used = 0;
    std::unique_ptr<VoxelBlock> block;
    SpillPiece piece;
    /// Of a block on disk: two bits a voxel.
    std::array<uint8_t, VoxelBlock::kCount / 4> states{};
  };

  VoxelBlock* Use(Slot* slot) const {
    // Written once between two calls of Trim, so that threads do not wait for one another.
    if (slot->used.load(std::memory_order_relaxed) != trim_count_) {
      slot->used.store(trim_count_, std::memory_order_relaxed);
    }
    if (!slot->is_here.load(std::memory_order_acquire)) Load(slot);
    return slot->block.get();
  }
  void Load(Slot* slot) const;
  absl::Status PutAway(Slot* slot) const;
  VoxelState StateOf(const Voxel& voxel) const;
  VoxelState StateIn(const Slot& slot, int index) const;

  double voxel_m_;
  SpillOptions spill_;
  int64_t resident_count_max_;
  absl::flat_hash_map<uint64_t, Slot*> by_key_;
  std::vector<std::unique_ptr<Slot>> slots_;
  /// What is in memory and what on disk is nobody else's business, hence `mutable`.
  std::unique_ptr<SpillFile> file_;
  std::unique_ptr<std::mutex> loading_;
  mutable int64_t resident_count_ = 0;
  mutable uint32_t trim_count_ = 0;
  mutable absl::Status status_;
};

}  // namespace dsg::ingest
