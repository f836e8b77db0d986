// SPDX-License-Identifier: Apache-2.0
// Normals of a surface that came without any.
#pragma once

#include "ingest/objects/cell_graph.h"

namespace dsg::ingest {

/// Fits a plane to each cell and the cells up to two steps away. Which side was seen stays unknown:
/// normals point up, or to +x, +y where they are level. Cells with too few neighbours for a plane
/// get zero. Overwrites all normals.
void EstimateNormals(CellGraph* graph);

}  // namespace dsg::ingest
