// SPDX-License-Identifier: Apache-2.0
// The few most voted ids of a voxel with their votes, instead of one number for every class.
// Refuses id 0, which means "unknown" and is no vote.
#pragma once

#include <array>
#include <cstdint>

namespace dsg::ingest {

/// Four slots of id << 8 | votes. With one confidence for all classes the Bayesian posterior
/// depends on the votes alone, so its arg max is the slot with most votes, except when more than
/// four ids contend.
template <typename Packed>
class LabelSlots {
 public:
  static constexpr int kCount = 4;
  static constexpr uint32_t kVotesMax = 255;
  static constexpr uint32_t kIdMax = static_cast<Packed>(~Packed{0}) >> 8;

  uint32_t id(int slot) const { return static_cast<uint32_t>(slots_[slot]) >> 8; }
  uint32_t votes(int slot) const { return static_cast<uint32_t>(slots_[slot]) & 0xff; }

  /// The id with most votes, the one in the first slot of equals; 0 = none.
  uint32_t Best() const { return id(BestSlot()); }
  int BestSlot() const {
    int best = 0;
    for (int i = 1; i < kCount; ++i) {
      if (votes(i) > votes(best)) best = i;
    }
    return best;
  }

  /// Requires: 0 < id <= kIdMax.
  void Add(uint32_t voted) {
    int least = 0;
    for (int i = 0; i < kCount; ++i) {
      if (id(i) == voted && votes(i) > 0) return Increment(i);
      if (votes(i) < votes(least)) least = i;
    }
    if (votes(least) <= 1) {
      slots_[least] = static_cast<Packed>(voted << 8 | 1);
    } else {
      --slots_[least];
    }
  }

 private:
  // Full counters are halved together: proportions stay, and old votes lose weight.
  void Increment(int slot) {
    if (votes(slot) == kVotesMax) {
      for (int i = 0; i < kCount; ++i) {
        slots_[i] = static_cast<Packed>(id(i) << 8 | votes(i) / 2);
      }
    }
    ++slots_[slot];
  }

  std::array<Packed, kCount> slots_{};
};

}  // namespace dsg::ingest
