// SPDX-License-Identifier: Apache-2.0
// Removes places that stand beside another one which can take their part.
// Refuses to cut ways: all links of a removed place lead on from the other one.
#pragma once

#include "ingest/places/place_options.h"
#include "ingest/places/roadmap.h"

namespace dsg::ingest {

/// The roadmap without its spare places, the narrowest removed first.
Roadmap ThinOut(const Roadmap& roadmap, const PlaceOptions& options);

}  // namespace dsg::ingest
