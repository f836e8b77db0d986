// SPDX-License-Identifier: Apache-2.0
// Who seen before somebody is, by the shape of the body and by how far one can walk.
// Refuses to guess without shapes.
#pragma once

#include <vector>

#include "ingest/agents/tracking/shape_statistics.h"
#include "ingest/agents/tracking/track_entry.h"

namespace dsg::ingest {

/// Somebody whose identity is asked for.
struct Stranger {
  TimeNs first_ns = 0;
  const Skeleton* skeleton = nullptr;
  const ShapeMean* shape = nullptr;
};

/// Tracks that may be the same person, likeliest first, then by track: those whose shape is
/// likelier than again_ratio_min, with probabilities over all of them and "somebody new", who
/// counts as much as each of them before shapes are looked at.
std::vector<SameAs> FindAgain(const Stranger& stranger,
                              const std::vector<const TrackEntry*>& earlier,
                              const ShapeStatistics& shapes, const TrackerOptions& options);

}  // namespace dsg::ingest
