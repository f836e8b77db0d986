// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/floor_levels.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace dsg::ingest {
namespace {

struct Bin {
  int64_t count = 0;
  double z_sum = 0.0;
};

std::map<int64_t, Bin> Histogram(const std::vector<const MeshBlock*>& mesh,
                                 const std::vector<int32_t>& class_ids,
                                 const FloorLevelOptions& options) {
  const auto up_min = static_cast<float>(options.up_min);
  std::map<int64_t, Bin> bins;
  for (const MeshBlock* block : mesh) {
    if (block == nullptr || block->labels.size() != block->positions_map.size()) continue;
    const bool has_normals = block->normals_map.size() == block->positions_map.size();
    for (size_t i = 0; i < block->labels.size(); ++i) {
      const float z = block->positions_map[i].z();
      if (!std::isfinite(z) || std::abs(z) > 1e6f) continue;
      if (has_normals && !(block->normals_map[i].z() >= up_min)) continue;
      if (std::binary_search(class_ids.begin(), class_ids.end(),
                             static_cast<int32_t>(block->labels[i]))) {
        continue;
      }
      Bin& bin = bins[static_cast<int64_t>(std::floor(static_cast<double>(z) / options.bin_m))];
      ++bin.count;
      // Whole micrometres: sums do not depend on the order of the blocks.
      bin.z_sum += std::round(static_cast<double>(z) * 1e6);
    }
  }
  return bins;
}

// A floor on the border of two bins is in both.
Bin WithNeighbors(const std::map<int64_t, Bin>& bins, int64_t index) {
  Bin sum;
  for (int64_t i = index - 1; i <= index + 1; ++i) {
    const auto found = bins.find(i);
    if (found == bins.end()) continue;
    sum.count += found->second.count;
    sum.z_sum += found->second.z_sum;
  }
  return sum;
}

}  // namespace

std::vector<double> FindFloorLevels(const std::vector<const MeshBlock*>& mesh,
                                    const std::vector<int32_t>& class_ids,
                                    const FloorLevelOptions& options) {
  const std::map<int64_t, Bin> bins = Histogram(mesh, class_ids, options);
  std::vector<Bin> peaks;
  for (const auto& [index, bin] : bins) peaks.push_back(WithNeighbors(bins, index));
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const Bin& a, const Bin& b) { return a.count > b.count; });
  std::vector<double> levels;
  for (const Bin& peak : peaks) {
    if (static_cast<double>(peak.count) <
        options.share_min * static_cast<double>(peaks.front().count)) {
      break;
    }
    const double z_m = peak.z_sum / static_cast<double>(peak.count) * 1e-6;
    const bool is_known = std::any_of(levels.begin(), levels.end(), [&](double level) {
      return std::abs(level - z_m) < options.storey_m;
    });
    if (!is_known) levels.push_back(z_m);
  }
  std::sort(levels.begin(), levels.end());
  return levels;
}

std::optional<double> FloorBelow(const std::vector<double>& levels, double z_m,
                                 const FloorLevelOptions& options) {
  const auto above = std::upper_bound(levels.begin(), levels.end(), z_m + options.step_m);
  if (above == levels.begin()) return std::nullopt;
  return *(above - 1);
}

}  // namespace dsg::ingest
