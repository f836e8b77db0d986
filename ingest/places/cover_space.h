// SPDX-License-Identifier: Apache-2.0
// Adds places until all of the space where a robot fits is in straight reach of one.
// Refuses to link them.
#pragma once

#include <vector>

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// Where a robot has been without a place near and in sight, there will be one.
void CoverPath(const std::vector<Eigen::Vector3d>& path_map, const PlaceOptions& options,
               Roadmap* roadmap);

/// Widest spots first. Corners that are too narrow for a robot but not for its middle to look
/// into are covered by a place that sees them.
void CoverSpace(const PlaceOptions& options, Roadmap* roadmap);

}  // namespace dsg::ingest
