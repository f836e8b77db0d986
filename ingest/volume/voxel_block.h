// SPDX-License-Identifier: Apache-2.0
// 8 x 8 x 8 voxels, the unit in which the volume is kept.
// Refuses to know its neighbours.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <limits>
#include <vector>

#include "ingest/volume/label_slots.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Voxels with less weight count as not seen.
inline constexpr float kSeenWeight = 1e-4f;

struct Voxel {
  /// Positive on the side that has been seen free.
  float distance_m = 0.0f;
  float weight = 0.0f;
  std::array<uint8_t, 3> rgb{};
  uint8_t color_count = 0;
  /// Distance that the last mesh was made from; see published_field.h.
  int16_t published = std::numeric_limits<int16_t>::min();

  bool IsSeen() const { return weight > kSeenWeight; }
};
static_assert(sizeof(Voxel) == 16);

struct VoxelLabels {
  LabelSlots<uint16_t> classes;
  /// Ids of the map, before unions.
  LabelSlots<uint32_t> instances;
};

/// Covers [key, key + 1) x 8 voxels on each axis.
struct BlockKey {
  int32_t x = 0;
  int32_t y = 0;
  int32_t z = 0;
  auto operator<=>(const BlockKey&) const = default;
};

struct VoxelBlock {
  static constexpr int kSide = 8;
  static constexpr int kCount = kSide * kSide * kSide;
  static constexpr uint16_t kNoLabels = 0xffff;

  static int IndexOf(int x, int y, int z) { return (z * kSide + y) * kSide + x; }

  /// Null when nothing was ever seen of the voxel's label.
  const VoxelLabels* LabelsOf(int index) const {
    if (label_index.empty() || label_index[index] == kNoLabels) return nullptr;
    return &labels[label_index[index]];
  }
  VoxelLabels* MakeLabels(int index);
  /// As new, but for the memory held.
  void Clear();

  BlockKey key;
  std::array<Voxel, kCount> voxels;
  /// Voxel to its place in `labels`; empty until a surface has been seen in the block. Only one
  /// voxel in three is near enough to a surface to have labels.
  std::vector<uint16_t> label_index;
  std::vector<VoxelLabels> labels;
  /// When anything was read in it, first and last.
  TimeNs first_seen_ns = kTimeMax;
  TimeNs last_seen_ns = kTimeMin;
  /// When a surface was near, first and last; the first is after the last when none was.
  TimeNs first_surface_ns = kTimeMax;
  TimeNs last_surface_ns = kTimeMin;
  /// Some voxel has been written by the frame at hand.
  bool updated = false;
  /// A surface has ever been near.
  bool has_surface = false;
  /// In the list of blocks to look at for the next mesh.
  bool queued = false;
  /// A label next to the surface is another one than in the last mesh.
  bool label_changed = false;
};

}  // namespace dsg::ingest
