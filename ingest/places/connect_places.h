// SPDX-License-Identifier: Apache-2.0
// Joins parts of a roadmap that free space joins.
// Refuses to leave free space: what no robot can reach stays apart.
#pragma once

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// Smaller parts first, each by the cheapest way over open cells to a place of another one, with
/// a place wherever the way bends.
void ConnectParts(const PlaceOptions& options, Roadmap* roadmap);

}  // namespace dsg::ingest
