// SPDX-License-Identifier: Apache-2.0
// The end of a track as predictions want it: even steps, and no gap.
// Refuses to look before a gap: who was away may have turned.
#pragma once

#include <vector>

#include "query/prediction/prediction.h"

namespace dsg::query {

/// The step that people's velocities are taken over; shorter ones are noise of detections.
inline constexpr TimeNs kTrackStepNs = 400'000'000;
/// What is looked at of a track.
inline constexpr TimeNs kTrackSeenNs = 8'000'000'000;

/// Points every kTrackStepNs back from the last pose, linear between poses, over at most
/// kTrackSeenNs and no gap longer than `gap_ns_max`. Of a track of less than one step its first
/// pose too, if that is half a step old.
/// Requires: ascending times.
std::vector<PathPoint> RecentTrack(const std::vector<PathPoint>& poses, TimeNs gap_ns_max);

}  // namespace dsg::query
