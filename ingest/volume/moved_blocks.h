// SPDX-License-Identifier: Apache-2.0
// A volume after the path that it was seen from was corrected: its blocks move with the path.
#pragma once

#include "ingest/trajectory/trajectory_change.h"
#include "ingest/volume/block_map.h"

namespace dsg::ingest {

/// Each block moves stiffly, as MoveOf says for the times at which it was seen, and is sampled into
/// the voxels that it covers then. Where two blocks come to lie, their distances are averaged by
/// weight; a gap of up to a voxel between blocks that move apart is filled from both sides. Blocks
/// that do not move are copied as they are.
///
/// Frames are not fused again here: that would need all of them, and their time, for each loop
/// closure. What was merged wrongly stays merged until a log is read again at its end (ADR 0016).
/// Cost: about 10 million voxels a second. Deterministic. Both maps keep as many blocks in memory
/// as `blocks` may, and write the others to disk: pointers to blocks are void afterwards, and
/// status() of both says whether the disk did as it should.
BlockMap MoveBlocks(const BlockMap& blocks, const TrajectoryChange& change);

}  // namespace dsg::ingest
