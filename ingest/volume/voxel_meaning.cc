// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/voxel_meaning.h"

#include <cmath>

namespace dsg::ingest {
namespace {

// Class ids have one byte, and 0 is no class.
constexpr double kClassCount = 255.0;
// Two classes with as many votes both have one half; the first one seen stays.
constexpr float kPosteriorMin = 0.499f;

}  // namespace

uint32_t InstanceBook::Add(uint32_t class_id) {
  if (size() > kIdMax) return 0;
  parent_.push_back(size());
  class_.push_back(class_id);
  return size() - 1;
}

VoxelMeaning::VoxelMeaning(double confidence) {
  const double step = std::log((1.0 - confidence) / (kClassCount - 1.0) / confidence);
  for (size_t n = 0; n < odds_behind_.size(); ++n) {
    odds_behind_[n] = static_cast<float>(std::exp(step * static_cast<double>(n)));
  }
}

uint32_t VoxelMeaning::ClassOf(const VoxelLabels& labels) const {
  const auto& classes = labels.classes;
  const int best = classes.BestSlot();
  const uint32_t votes = classes.votes(best);
  if (votes == 0) return 0;
  float total = static_cast<float>(kClassCount) * odds_behind_[votes];
  for (int i = 0; i < classes.kCount; ++i) {
    if (classes.votes(i) > 0) total += odds_behind_[votes - classes.votes(i)] - odds_behind_[votes];
  }
  return 1.0f / total < kPosteriorMin ? 0 : classes.id(best);
}

uint32_t VoxelMeaning::InstanceOf(const VoxelLabels& labels, uint32_t class_id,
                                  const InstanceBook& book) {
  const auto& slots = labels.instances;
  uint32_t best = 0;
  uint32_t best_votes = 0;
  for (int i = 0; i < slots.kCount; ++i) {
    if (slots.votes(i) == 0) continue;
    const uint32_t root = book.Root(slots.id(i));
    if (book.ClassOf(root) != class_id) continue;
    uint32_t votes = 0;
    for (int j = 0; j < slots.kCount; ++j) {
      if (slots.votes(j) > 0 && book.Root(slots.id(j)) == root) votes += slots.votes(j);
    }
    if (votes > best_votes || (votes == best_votes && root < best)) {
      best = root;
      best_votes = votes;
    }
  }
  return best;
}

}  // namespace dsg::ingest
