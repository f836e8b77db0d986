// SPDX-License-Identifier: Apache-2.0
// Ways through walls in a plan: short and narrow, with more space on both sides.
// Refuses passages that are as narrow before and behind: those are corridors, but for their mouths
// into halls.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/grid/distance_field.h"
#include "ingest/rooms/room_options.h"

namespace dsg::ingest {

/// The line from jamb to jamb.
struct WallGap {
  Eigen::Vector2d from_map = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_map = Eigen::Vector2d::Zero();

  double WidthM() const { return (to_map - from_map).norm(); }
  Eigen::Vector2d MiddleMap() const { return 0.5 * (from_map + to_map); }
  /// Unit, through the gap.
  Eigen::Vector2d NormalMap() const {
    const Eigen::Vector2d along = (to_map - from_map).normalized();
    return {-along.y(), along.x()};
  }
};

/// `plan`: of one cell's height. Ends are occupied cells, never unknown ones.
/// Order: by width. Source: critical points of Voronoi graphs, Thrun 1998; the test of the jambs
/// is ours.
std::vector<WallGap> FindWallGaps(const DistanceField& plan, const WallGapOptions& options);

/// Makes the cells on a gap's line occupied, without a hole for 4-neighbours.
void CloseGap(const WallGap& gap, OccupancyGrid* plan);

}  // namespace dsg::ingest
