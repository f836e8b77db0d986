// SPDX-License-Identifier: Apache-2.0
// Ways from cell to cell, and how they become places and links.
// Refuses to search them; see connect_places.h and shortcuts.h.
#pragma once

#include <utility>
#include <vector>

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// A robot fits in all cells that a step to a neighbour may touch.
bool CanStep(const OpenSpace& space, const Eigen::Vector3i& cell, const Eigen::Vector3i& offset);

/// Cells of a way at which it has to bend, with its ends; each as far from the last one as a
/// straight way leads, but not above PlaceOptions::way_m.
/// Requires: CanStep from each cell to the next.
std::vector<int64_t> Straighten(const OpenSpace& space, const std::vector<int64_t>& way,
                                const PlaceOptions& options);

/// A place at each bend, or one beside it that can serve, and a link from each to the next.
/// Returns those links.
std::vector<std::pair<int, int>> AddWay(const std::vector<int64_t>& bends,
                                        const PlaceOptions& options, Roadmap* roadmap);

}  // namespace dsg::ingest
