// SPDX-License-Identifier: Apache-2.0
// Cuts clusters where two instances touch, and joins the parts that an occlusion has cut.
// Refuses to believe instances that are interwoven: they are one thing with two numbers.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/objects/object_options.h"
#include "ingest/objects/surface_cells.h"

namespace dsg::ingest {

/// Indices of cells of one class, ascending.
using CellGroup = std::vector<int>;

/// The instance of most cells that have one, the lower of nearly as frequent ones, so that it does
/// not change back and forth; 0 when too few of the cells have it.
uint32_t DominantInstance(const std::vector<SurfaceCell>& cells, const CellGroup& group,
                          const PieceOptions& options = {});

/// The group, or one group for each instance that has a share of the support of itself and the
/// most frequent one together and lies beside the others; the rest goes to the nearest of them.
std::vector<CellGroup> SplitByInstance(const std::vector<SurfaceCell>& cells,
                                       const CellGroup& group, double tolerance_m,
                                       const PieceOptions& options = {});

/// Joins the groups of one class with one dominant instance and less than a gap between them.
/// Specks are not joined.
std::vector<CellGroup> MergeByInstance(const std::vector<SurfaceCell>& cells,
                                       std::vector<CellGroup> groups,
                                       const PieceOptions& options = {});

/// Without the groups that have less than a share of the cells of the largest group of their class
/// and dominant instance: labels that bled onto something else.
std::vector<CellGroup> DropEchoes(const std::vector<SurfaceCell>& cells,
                                  std::vector<CellGroup> groups, const PieceOptions& options = {});

}  // namespace dsg::ingest
