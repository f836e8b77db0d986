// SPDX-License-Identifier: Apache-2.0
// Links places with their neighbours all around.
// Refuses long links where a shorter one leads the same way.
#pragma once

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// Nearest neighbours first, at most one per direction, so that ways over the links are hardly
/// longer than straight ones.
///
/// Source: Yao, 1982 (graphs of the nearest neighbour per cone).
void LinkNeighbours(const PlaceOptions& options, Roadmap* roadmap);

}  // namespace dsg::ingest
