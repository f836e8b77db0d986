// SPDX-License-Identifier: Apache-2.0
// Which voxel blocks a frame can say something about.
// Refuses to be exact: some of them may turn out to be hidden or outside the image.
#pragma once

#include <vector>

#include "ingest/volume/frame_view.h"
#include "ingest/volume/voxel_block.h"

namespace dsg::ingest {

/// Order: ascending. No more than `count_max` + 1 of them.
std::vector<BlockKey> FindVisibleBlocks(const FrameView& view, const VolumeOptions& options,
                                        int64_t count_max);

}  // namespace dsg::ingest
