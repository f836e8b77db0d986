// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/open_space.h"

#include <utility>

namespace dsg::ingest {

OpenSpace::OpenSpace(OccupancyGrid grid, double robot_radius_m)
    : field_(std::move(grid)), robot_radius_m_(robot_radius_m) {
  const int up = IsFlat() ? 0 : 1;
  for (int z = -up; z <= up; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (x != 0 || y != 0 || z != 0) neighbours_.emplace_back(x, y, z);
      }
    }
  }
}

bool OpenSpace::IsWayFor(int64_t from, int64_t to, double radius_m) const {
  return field_.HasClearance(CenterOf(from), CenterOf(to), radius_m - kRoundingM);
}

}  // namespace dsg::ingest
