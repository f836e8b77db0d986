// SPDX-License-Identifier: Apache-2.0
// A storey seen from above: what is free in a horizontal slice of the map.
// Refuses to take what was never seen for free, except for small holes.
#pragma once

#include <optional>
#include <vector>

#include "ingest/grid/occupancy_grid.h"
#include "ingest/rooms/room_options.h"

namespace dsg::ingest {

/// A grid of one cell's height with the columns of another.
OccupancyGrid EmptyPlan(const GridFrame& frame);

/// Heights of the ceiling over each column of a grid, metres; NaN where there is none.
///
/// A height counts where many columns around share it, so that lintels and beams are no ceilings,
/// and rooms of unlike height each have their own.
struct CeilingMap {
  std::vector<float> z_m;
  /// Share of the columns with something known above the doors that saw a ceiling, 0 to 1.
  double seen_share = 0.0;
};

/// `ceiling_z_m`: for columns whose own ceiling was not seen.
CeilingMap FindCeilings(const OccupancyGrid& grid, double floor_z_m,
                        const std::optional<double>& ceiling_z_m, const SectionOptions& options);

/// The state of each column below its ceiling; where that was not seen, at multiples of that
/// distance, as long as that is above the doors. Source: RSS 2020, section IV-C.
OccupancyGrid CeilingSection(const OccupancyGrid& grid, double floor_z_m,
                             const CeilingMap& ceilings, const SectionOptions& options);

/// What stands as high as a person's head; lower down where that was not seen. Tables, beds and
/// chairs are not in it. A grid of one cell's height is taken as it is.
OccupancyGrid BodySection(const OccupancyGrid& grid, double floor_z_m,
                          const SectionOptions& options);

/// Takes unknown cells for free where free cells close around them: holes up to `width_m`.
void FillHoles(double width_m, OccupancyGrid* plan);

/// Unknown cells of `plan` become what they are in `other`.
void FillFrom(const OccupancyGrid& other, OccupancyGrid* plan);
/// Unknown cells of `plan` become occupied where `other` is.
void FillOccupiedFrom(const OccupancyGrid& other, OccupancyGrid* plan);

}  // namespace dsg::ingest
