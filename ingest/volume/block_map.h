// SPDX-License-Identifier: Apache-2.0
// Finds voxel blocks by where they are, and holds them.
// Refuses to be walked in hash order: blocks have numbers in the order of their making.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "ingest/volume/voxel_block.h"

namespace dsg::ingest {

/// Threads: reading from many.
class BlockMap {
 public:
  /// Keys beyond this on an axis are refused by the callers.
  static constexpr int32_t kKeyMax = (1 << 20) - 2;

  explicit BlockMap(double voxel_m) : voxel_m_(voxel_m) {}

  double voxel_m() const { return voxel_m_; }
  int64_t size() const { return static_cast<int64_t>(blocks_.size()); }
  /// Requires: 0 <= number < size().
  VoxelBlock& block(int64_t number) { return *blocks_[number]; }
  const VoxelBlock& block(int64_t number) const { return *blocks_[number]; }

  /// Null when there is none.
  VoxelBlock* Find(const BlockKey& key) const;
  /// Requires: there is none of its key yet.
  void Insert(std::unique_ptr<VoxelBlock> block);

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
  double voxel_m_;
  absl::flat_hash_map<uint64_t, VoxelBlock*> by_key_;
  std::vector<std::unique_ptr<VoxelBlock>> blocks_;
};

}  // namespace dsg::ingest
