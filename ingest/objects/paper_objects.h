// SPDX-License-Identifier: Apache-2.0
// Objects of unknown shape to the letter of RSS 2020: the mesh of a class, in Euclidean clusters.
// Refuses instances, floors and votes; object_cluster.h has them.
#pragma once

#include <vector>

#include "ingest/objects/object_cluster.h"

namespace dsg::ingest {

/// The vertices of each class in clusters of steps of at most twice the voxel. A cluster stands at
/// the mean of its vertices, in a box along the axes of the map that holds all of them; fewer
/// vertices than PieceOptions::cell_count_min are none.
///
/// Order: as FindClusters. Blocks whose labels have a wrong length are ignored.
/// Source: RSS 2020, section IV-B ("Objects with Unknown Shape").
std::vector<ObjectCluster> FindPaperObjects(const std::vector<const MeshBlock*>& mesh,
                                            const ClusterOptions& options);

}  // namespace dsg::ingest
