// SPDX-License-Identifier: Apache-2.0
// How near an agent's hands and body came to an object, and for how long.
// Refuses to guess hands that nobody saw.
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "query/engine/interaction/track_path.h"

namespace dsg::query {

/// Within this of an object's box, measured from the torso along the floor, it can be reached.
inline constexpr double kReachM = 1.5;
/// Torso to box along the floor while somebody handles the object.
inline constexpr double kDwellM = 0.8;

struct Nearness {
  /// Hand to box; nullopt where no shape with joints was seen.
  std::optional<double> hand_m;
  TimeNs hand_ns = 0;
  /// Torso to box along the floor; nullopt where the track has no pose.
  std::optional<double> torso_m;
  TimeNs torso_ns = 0;
  /// How long the torso was within kDwellM, seconds, gaps excluded.
  double dwell_s = 0.0;
  /// First and last time within kReachM; meaningful if `reached`.
  bool reached = false;
  Interval visit;
  /// Share of `visit` in gaps of the track, 0 to 1.
  double unobserved_share = 0.0;
};

/// During [during.from_ns, during.to_ns].
/// Cost: the poses of the track during that, and the body shapes while within reach.
absl::StatusOr<Nearness> MeasureNearness(const Snapshot& snapshot, const TrackInfo& track,
                                         const Box3d& box_map, const Interval& during,
                                         const StopCheck& stop);

}  // namespace dsg::query
