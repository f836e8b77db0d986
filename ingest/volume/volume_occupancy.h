// SPDX-License-Identifier: Apache-2.0
// A dense grid of what has been seen, from blocks of voxels.
// Refuses to grow beyond memory: blocks far from all others are left out.
#pragma once

#include "ingest/grid/occupancy_grid.h"
#include "ingest/volume/block_map.h"

namespace dsg::ingest {

/// A voxel is occupied where a surface passes through it or it is inside one (distance below half
/// a voxel), so that walls are closed and doors are not narrowed by the truncation band. A cell of
/// several voxels is occupied if one of them is, free if at least half of them are, else unknown.
OccupancyGrid MakeVolumeOccupancy(const BlockMap& blocks, double cell_m);

/// Blocks whose middle is not in `frame`.
int64_t CountBlocksOutside(const BlockMap& blocks, const GridFrame& frame);

}  // namespace dsg::ingest
