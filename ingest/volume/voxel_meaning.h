// SPDX-License-Identifier: Apache-2.0
// What a voxel's votes say it is.
// Refuses to name a class that is less likely than not.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ingest/volume/voxel_block.h"

namespace dsg::ingest {

/// Instances of the map: some turn out to be one thing and are joined.
class InstanceBook {
 public:
  static constexpr uint32_t kIdMax = (uint32_t{1} << 24) - 1;

  /// 0 when all ids are used up.
  uint32_t Add(uint32_t class_id);
  /// `loser` becomes another name of `winner`. Requires: two roots of one class.
  void Join(uint32_t winner, uint32_t loser) { parent_[loser] = winner; }
  /// The id that stands for all that were joined with `id`.
  uint32_t Root(uint32_t id) const {
    while (parent_[id] != id) id = parent_[id];
    return id;
  }
  uint32_t ClassOf(uint32_t id) const { return class_[id]; }
  uint32_t size() const { return static_cast<uint32_t>(parent_.size()); }

 private:
  // Index 0 is "none".
  std::vector<uint32_t> parent_{0};
  std::vector<uint32_t> class_{0};
};

/// The class with the highest posterior, given that a pixel shows the class it says with
/// probability `confidence` and any other one with equal shares of the rest; 0 when the posterior
/// is below one half.
/// Source: Rosinol et al., 2020 (Kimera), label fusion.
class VoxelMeaning {
 public:
  explicit VoxelMeaning(double confidence);

  uint32_t ClassOf(const VoxelLabels& labels) const;
  /// The instance of the class with most votes, the lowest id of equals; 0 = none.
  static uint32_t InstanceOf(const VoxelLabels& labels, uint32_t class_id,
                             const InstanceBook& book);

 private:
  // Odds against a class that is `n` votes behind.
  std::array<float, 256> odds_behind_{};
};

}  // namespace dsg::ingest
