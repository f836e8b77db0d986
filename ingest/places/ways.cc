// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/ways.h"

#include <algorithm>

namespace dsg::ingest {
namespace {

// A spot near a bend that can take its part; -1 = none.
int SpotBeside(const Roadmap& roadmap, double bend_m, int from, int64_t bend, int64_t next) {
  const OpenSpace& space = roadmap.space();
  for (const auto& [distance_m, spot] : roadmap.Near(space.CenterOf(bend), bend_m)) {
    const int64_t cell = roadmap.cell(spot);
    const bool can_serve =
        spot != from && space.IsOpenWay(roadmap.cell(from), cell) && space.IsOpenWay(cell, next);
    if (can_serve) return spot;
  }
  return -1;
}

}  // namespace

bool CanStep(const OpenSpace& space, const Eigen::Vector3i& cell, const Eigen::Vector3i& offset) {
  const GridFrame& frame = space.frame();
  if (!frame.Holds(cell + offset)) return false;
  for (int mask = 1; mask < 8; ++mask) {
    const Eigen::Vector3i part((mask & 1) != 0 ? offset.x() : 0, (mask & 2) != 0 ? offset.y() : 0,
                               (mask & 4) != 0 ? offset.z() : 0);
    if (!space.IsOpen(frame.Index(cell + part))) return false;
  }
  return true;
}

std::vector<int64_t> Straighten(const OpenSpace& space, const std::vector<int64_t>& way,
                                const PlaceOptions& options) {
  const auto far = std::max<size_t>(1, static_cast<size_t>(options.way_m / space.frame().cell_m));
  std::vector<int64_t> bends;
  if (!way.empty()) bends.push_back(way.front());
  size_t at = 0;
  while (at + 1 < way.size()) {
    size_t next = std::min(at + far, way.size() - 1);
    while (next > at + 1 && !space.IsOpenWay(way[at], way[next])) --next;
    bends.push_back(way[next]);
    at = next;
  }
  return bends;
}

std::vector<std::pair<int, int>> AddWay(const std::vector<int64_t>& bends,
                                        const PlaceOptions& options, Roadmap* roadmap) {
  std::vector<std::pair<int, int>> links;
  if (bends.empty()) return links;
  int from = roadmap->Add(bends.front());
  for (size_t i = 1; i < bends.size(); ++i) {
    const bool is_end = i + 1 == bends.size();
    const int to = is_end ? -1 : SpotBeside(*roadmap, options.bend_m, from, bends[i], bends[i + 1]);
    const int next = to >= 0 ? to : roadmap->Add(bends[i]);
    if (roadmap->Link(from, next)) links.emplace_back(from, next);
    from = next;
  }
  return links;
}

}  // namespace dsg::ingest
