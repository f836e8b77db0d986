// SPDX-License-Identifier: Apache-2.0
// When an agent was within reach of an object, or may have been while nobody looked, and how near
// its hands came. Hands count only where they were seen.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/interaction/track_path.h"

namespace dsg::query {

/// Within this of an object's box, measured from the torso along the floor, it can be reached.
inline constexpr double kReachM = 1.5;
/// Torso to box along the floor while somebody handles the object.
inline constexpr double kDwellM = 0.8;
/// How fast somebody whom nobody looks at is believed to walk, straight to the object and away.
inline constexpr double kWalkMS = 1.5;
/// How long before its first and after its last pose somebody is believed to have been about; of
/// longer gaps, no more than that at both ends counts.
inline constexpr TimeNs kAboutNs = 10 * kNsPerSecond;

/// A stretch of time within kReachM, without a break; gaps of the track that leave time to come
/// near and go away again are part of it.
/// Source: Hagerstrand, 1970 (space-time prisms).
struct Visit {
  /// Both ends included.
  Interval during;
  /// Within reach at a pose, or between two that are joined; in gaps alone otherwise.
  bool is_seen = false;
  /// From the first to the last time that it was seen there; meaningful if `is_seen`.
  Interval seen;
  /// Hand to box; nullopt where no shape with joints was seen.
  std::optional<double> hand_m;
  TimeNs hand_ns = 0;
  /// Torso to box along the floor, where it was seen nearest.
  double torso_m = 0.0;
  TimeNs torso_ns = 0;
  /// How long the torso was within kDwellM, seconds, gaps excluded.
  double dwell_s = 0.0;
  /// How long it may have been within reach in gaps.
  double unseen_s = 0.0;
};

struct Nearness {
  /// Ascending.
  std::vector<Visit> visits;
  /// Torso to box along the floor; nullopt where the track has no pose then.
  std::optional<double> torso_m;
  TimeNs torso_ns = 0;
};

/// During [during.from_ns, during.to_ns].
/// Cost: the poses of the track during that, and the body shapes while within reach.
absl::StatusOr<Nearness> MeasureNearness(const Snapshot& snapshot, const TrackInfo& track,
                                         const Box3d& box_map, const Interval& during,
                                         const StopCheck& stop);

}  // namespace dsg::query
