// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/instance_shuffle.h"

#include <utility>

#include "ingest/simulator/sensors/streams.h"
#include "schema/base/random.h"

namespace dsg::simulator {

const InstanceShuffle::Table& InstanceShuffle::TableOf(int class_id) {
  const auto [entry, is_new] = tables_.try_emplace(class_id);
  Table& table = entry->second;
  if (!is_new) return table;
  for (size_t i = 0; i < table.size(); ++i) table[i] = static_cast<uint8_t>(i);
  Random random(
      seed_, FrameStream(FrameNoise::kInstances, image_index_) + static_cast<uint64_t>(class_id));
  for (int i = 255; i > 1; --i) std::swap(table[i], table[1 + random.Index(i)]);
  return table;
}

int InstanceShuffle::Shuffled(int class_id, int instance) {
  return instance == 0 ? 0 : TableOf(class_id)[static_cast<size_t>(instance)];
}

void InstanceShuffle::Apply(ingest::Image* labels) {
  for (size_t i = 0; i + 1 < labels->bytes.size(); i += 2) {
    uint8_t& instance = labels->bytes[i];
    if (instance != 0) instance = TableOf(labels->bytes[i + 1])[instance];
  }
}

}  // namespace dsg::simulator
