// SPDX-License-Identifier: Apache-2.0
// Which of an image's observations belongs to which track, by place, joints and shape.
// Refuses to open or close tracks.
#pragma once

#include <vector>

#include "ingest/agents/tracking/shape_statistics.h"
#include "ingest/agents/tracking/track_entry.h"

namespace dsg::ingest {

/// How far every joint may have moved within a gap: as far as in a second, or further.
/// Source: RSS 2020, section IV-A ("Human Nodes").
double ReachM(const TrackerOptions& options, TimeNs gap_ns);

/// For each observation the index in `tracks` of its track, -1 when none is consistent. All at
/// once: the least total cost. Requires: tracks whose last observation is before `time_ns`.
std::vector<int> AssignAll(const std::vector<TrackEntry*>& tracks,
                           const std::vector<SeenPerson>& seen, TimeNs time_ns,
                           const ShapeStatistics& shapes, const TrackerOptions& options);

/// The same, each observation to the first consistent track that is still free.
std::vector<int> AssignFirst(const std::vector<TrackEntry*>& tracks,
                             const std::vector<SeenPerson>& seen, TimeNs time_ns,
                             const TrackerOptions& options);

}  // namespace dsg::ingest
