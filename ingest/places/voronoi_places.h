// SPDX-License-Identifier: Apache-2.0
// Places in the middle between obstacles, from the generalized Voronoi diagram of free space.
// Refuses cells where a robot does not fit.
#pragma once

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// Number of obstacles, far apart and in different directions, that are nearest to a cell or to
/// its neighbours; two and more make it a part of the Voronoi diagram.
/// Requires: inside.
int CountBasisPoints(const OpenSpace& space, int64_t cell, const PlaceOptions& options);

/// Adds one spot per connected part of the diagram and block of the map, where the clearance is
/// largest, and links those whose parts touch; where no straight way joins the two, by one more
/// spot where the parts meet.
///
/// Source: Oleynikova et al., 2018 (diagram); Hughes et al., 2022 (blocks and their links).
void AddVoronoiPlaces(const PlaceOptions& options, Roadmap* roadmap);

}  // namespace dsg::ingest
