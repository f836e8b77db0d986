// SPDX-License-Identifier: Apache-2.0
// The objects of rooms without any labels: what is left of the surface without floors, walls and
// ceilings, taken apart where it bends inwards and put together to pieces of furniture.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/objects/object_cluster.h"
#include "ingest/objects/segment_options.h"

namespace dsg::ingest {

/// `class_id`: of all clusters. `floors_m`: heights of the floors, where known; otherwise they are
/// found. Labels of the mesh are ignored.
///
/// No box is longer than options.size_max_m. Order as of FindClusters; the same mesh gives the same
/// clusters, whatever the order of its blocks.
std::vector<ObjectCluster> FindUnlabelledObjects(const std::vector<const MeshBlock*>& mesh,
                                                 int32_t class_id, double voxel_m,
                                                 const std::vector<double>& floors_m,
                                                 const SegmentOptions& options,
                                                 const PieceOptions& pieces = {});

}  // namespace dsg::ingest
