// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/link_places.h"

namespace dsg::ingest {
namespace {

constexpr double kPlaceLinkM = 3.5;
// Links of one place are at least 40 degrees apart.
constexpr double kApartCosine = 0.866;
constexpr size_t kLinksPerPlace = 12;

void LinkAround(int spot, Roadmap* roadmap) {
  const Eigen::Vector3d at = roadmap->position_map(spot);
  std::vector<Eigen::Vector3d> directions;
  for (const auto& [distance_m, other] : roadmap->Near(at, kPlaceLinkM)) {
    if (other == spot || directions.size() >= kLinksPerPlace) continue;
    const Eigen::Vector3d direction = (roadmap->position_map(other) - at) / distance_m;
    bool is_taken = false;
    for (const Eigen::Vector3d& taken : directions) {
      is_taken = is_taken || taken.dot(direction) > kApartCosine;
    }
    if (!is_taken && roadmap->Link(spot, other)) directions.push_back(direction);
  }
}

}  // namespace

void LinkNeighbours(Roadmap* roadmap) {
  for (int spot = 0; spot < roadmap->spot_count(); ++spot) LinkAround(spot, roadmap);
}

}  // namespace dsg::ingest
