// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/link_places.h"

namespace dsg::ingest {
namespace {

void LinkAround(int spot, const PlaceOptions& options, Roadmap* roadmap) {
  const Eigen::Vector3d at = roadmap->position_map(spot);
  std::vector<Eigen::Vector3d> directions;
  for (const auto& [distance_m, other] : roadmap->Near(at, options.link_m)) {
    if (other == spot || static_cast<double>(directions.size()) >= options.link_count_max) continue;
    const Eigen::Vector3d direction = (roadmap->position_map(other) - at) / distance_m;
    bool is_taken = false;
    for (const Eigen::Vector3d& taken : directions) {
      is_taken = is_taken || taken.dot(direction) > options.link_apart_cosine;
    }
    if (!is_taken && roadmap->Link(spot, other)) directions.push_back(direction);
  }
}

}  // namespace

void LinkNeighbours(const PlaceOptions& options, Roadmap* roadmap) {
  for (int spot = 0; spot < roadmap->spot_count(); ++spot) LinkAround(spot, options, roadmap);
}

}  // namespace dsg::ingest
