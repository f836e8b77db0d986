// SPDX-License-Identifier: Apache-2.0
// Normals of a surface that came without any.
#pragma once

#include <vector>

#include "ingest/objects/cell_graph.h"

namespace dsg::ingest {

/// Fits a plane to each cell and the cells up to two steps away. Which side was seen stays unknown:
/// normals point up, or to +x, +y where they are level. Cells with too few neighbours for a plane
/// get zero. Overwrites all normals.
void EstimateNormals(CellGraph* graph);

/// Turns normals so that they look to the side of `sides` where that is not zero (by cell), and
/// elsewhere as the surface around goes on from there; pieces without any such cell look outwards.
/// The graph is oriented then. Requires: as many sides as cells.
/// Source: Hoppe et al., 1992, with normals mirrored between neighbours as Koenig and Gumhold,
/// 2009, do it, so that edges do not turn them.
void OrientNormals(const std::vector<Eigen::Vector3f>& sides, CellGraph* graph);

}  // namespace dsg::ingest
