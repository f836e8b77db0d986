// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "ingest/rooms/structure.h"

namespace dsg::ingest {
namespace {

std::vector<StructureHeight> HeightsOf(const std::vector<StructurePiece>& pieces,
                                       const std::string& type, double same_height_m) {
  // The largest pieces say where a height is; smaller ones add to it.
  std::vector<const StructurePiece*> sorted;
  for (const StructurePiece& piece : pieces) {
    if (piece.type == type && !piece.box_map.isEmpty()) sorted.push_back(&piece);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto* a, const auto* b) { return a->area_m2 > b->area_m2; });
  std::vector<StructureHeight> heights;
  for (const StructurePiece* piece : sorted) {
    const double z_m = piece->box_map.center().z();
    const auto same = std::find_if(heights.begin(), heights.end(), [&](const auto& height) {
      return std::abs(height.z_m - z_m) <= same_height_m;
    });
    if (same == heights.end()) {
      heights.push_back({z_m, piece->area_m2});
    } else {
      same->area_m2 += piece->area_m2;
    }
  }
  std::stable_sort(heights.begin(), heights.end(),
                   [](const auto& a, const auto& b) { return a.area_m2 > b.area_m2; });
  return heights;
}

}  // namespace

std::vector<StructureHeight> CeilingHeights(const std::vector<StructurePiece>& pieces,
                                            const StructureOptions& options) {
  return HeightsOf(pieces, "ceiling", options.same_height_m);
}

std::vector<StructureHeight> FloorHeights(const std::vector<StructurePiece>& pieces,
                                          const StructureOptions& options) {
  return HeightsOf(pieces, "floor", options.same_height_m);
}

}  // namespace dsg::ingest
