// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/thin_out.h"

#include <algorithm>
#include <numeric>

namespace dsg::ingest {
namespace {

using Neighbours = std::vector<std::set<int>>;

Neighbours NeighboursOf(const Roadmap& roadmap) {
  Neighbours next(static_cast<size_t>(roadmap.spot_count()));
  for (const auto& [a, b] : roadmap.links()) {
    next[static_cast<size_t>(a)].insert(b);
    next[static_cast<size_t>(b)].insert(a);
  }
  return next;
}

// The nearest neighbour from which one gets to all the others; -1 = none.
int Successor(const Roadmap& roadmap, double heir_m, int spot, const std::set<int>& neighbours) {
  for (const auto& [distance_m, other] : roadmap.Near(roadmap.position_map(spot), heir_m)) {
    if (neighbours.count(other) == 0) continue;
    const bool can_serve =
        std::all_of(neighbours.begin(), neighbours.end(), [&, heir = other](int neighbour) {
          return neighbour == heir ||
                 roadmap.space().IsOpenWay(roadmap.cell(heir), roadmap.cell(neighbour));
        });
    if (can_serve) return other;
  }
  return -1;
}

void Bequeath(int spot, int heir, Neighbours* next) {
  for (const int neighbour : (*next)[static_cast<size_t>(spot)]) {
    std::set<int>& theirs = (*next)[static_cast<size_t>(neighbour)];
    theirs.erase(spot);
    if (neighbour == heir) continue;
    theirs.insert(heir);
    (*next)[static_cast<size_t>(heir)].insert(neighbour);
  }
  (*next)[static_cast<size_t>(spot)].clear();
}

}  // namespace

Roadmap ThinOut(const Roadmap& roadmap, const PlaceOptions& options) {
  const OpenSpace& space = roadmap.space();
  std::vector<int> order(static_cast<size_t>(roadmap.spot_count()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return space.ClearanceM(roadmap.cell(a)) < space.ClearanceM(roadmap.cell(b));
  });
  Neighbours next = NeighboursOf(roadmap);
  std::vector<bool> is_gone(order.size(), false);
  for (const int spot : order) {
    const int heir = Successor(roadmap, options.heir_m, spot, next[static_cast<size_t>(spot)]);
    if (heir < 0) continue;
    Bequeath(spot, heir, &next);
    is_gone[static_cast<size_t>(spot)] = true;
  }
  Roadmap thin(&space);
  for (int spot = 0; spot < roadmap.spot_count(); ++spot) {
    if (!is_gone[static_cast<size_t>(spot)]) thin.Add(roadmap.cell(spot));
  }
  for (int spot = 0; spot < roadmap.spot_count(); ++spot) {
    for (const int other : next[static_cast<size_t>(spot)]) {
      if (spot < other) {
        thin.Link(thin.SpotAt(roadmap.cell(spot)), thin.SpotAt(roadmap.cell(other)));
      }
    }
  }
  return thin;
}

}  // namespace dsg::ingest
