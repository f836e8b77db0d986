// SPDX-License-Identifier: Apache-2.0
// Spares ways over a roadmap their detours between neighbouring places.
// Refuses links where the roadmap is almost as short.
#pragma once

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// Places are neighbours when somewhere both are nearer, on foot, than any other place. Pairs for
/// which the roadmap makes a detour get the way between them, the shortest pairs first.
///
/// Requires: a flat space. Cost: n log n in its cells.
void AddShortcuts(const PlaceOptions& options, Roadmap* roadmap);

}  // namespace dsg::ingest
