// SPDX-License-Identifier: Apache-2.0
// Cuts a surface into patches at its inner edges, and joins patches that are one thing.
#pragma once

#include <vector>

#include "ingest/objects/cell_graph.h"
#include "ingest/objects/instance_parts.h"
#include "ingest/objects/segment_options.h"

namespace dsg::ingest {

/// Patches of the cells of which `is_free` holds, each as even as its size allows; cells ascending,
/// patches ascending by their first cell. What bends outwards is cut later than what bends inwards.
/// Source: Felzenszwalb and Huttenlocher, 2004, over normals as Karpathy et al., 2013, do it.
std::vector<CellGroup> FindPatches(const CellGraph& graph, const std::vector<bool>& is_free,
                                   const SegmentOptions& options);

/// Groups of patches, as cells: the two that share most of their outlines become one, again and
/// again; contacts that bend inwards speak against it, unless they are a whole side of both. No
/// group has an upright box longer than size_max_m unless a patch of it has. `heights_m`: of the
/// cells above the floor.
/// Source: after Stein et al., 2014 (locally convex connected patches).
std::vector<CellGroup> JoinPatches(const CellGraph& graph, const std::vector<float>& heights_m,
                                   const std::vector<CellGroup>& patches,
                                   const SegmentOptions& options);

}  // namespace dsg::ingest
