// SPDX-License-Identifier: Apache-2.0
// Takes the identity out of a label image: in each image the instances of a class get other
// numbers, as a real panoptic network gives them.
// Refuses to touch classes; structures have no instances.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>

#include "ingest/sensor/image.h"

namespace dsg::simulator {

/// The renumbering of one image: a function of seed and image index only.
class InstanceShuffle {
 public:
  InstanceShuffle(uint64_t seed, int64_t image_index) : seed_(seed), image_index_(image_index) {}

  /// The instance of the class in this image. 0 stays 0.
  int Shuffled(int class_id, int instance);
  /// Requires: kLabel16.
  void Apply(ingest::Image* labels);

 private:
  using Table = std::array<uint8_t, 256>;
  const Table& TableOf(int class_id);

  uint64_t seed_;
  int64_t image_index_;
  std::unordered_map<int, Table> tables_;
};

}  // namespace dsg::simulator
