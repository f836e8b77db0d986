// SPDX-License-Identifier: Apache-2.0
// A stretch of a track as plain points, for questions about two tracks at once, and how much of an
// interval was observed. Gaps stay gaps: a step longer than the track allows joins nothing.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

struct TrackPoint {
  TimeNs time_ns = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
};

struct TrackPath {
  NodeId agent;
  TimeNs gap_ns_max = 0;
  /// Ascending time.
  std::vector<TrackPoint> points;

  /// Whether the straight line from point i to the next belongs to the track.
  bool IsJoined(size_t i) const;
};

/// The points from the last one at or before `from_ns` to the first one at or after `to_ns`, as far
/// as there are any.
absl::StatusOr<TrackPath> ReadTrackPath(const Snapshot& snapshot, const TrackInfo& track,
                                        TimeNs from_ns, TimeNs to_ns, const StopCheck& stop);

/// On the straight line between two points; exactly `b` at its time.
Eigen::Vector3d PositionBetween(const TrackPoint& a, const TrackPoint& b, TimeNs at_ns);

/// How far apart, also where the difference does not fit into 64 signed bits.
uint64_t TimeApart(TimeNs from_ns, TimeNs to_ns);

/// Sum that stops at the ends of time.
TimeNs AddTime(TimeNs time_ns, TimeNs span_ns);

/// 0 to 1: the union of all tracks without their gaps. An observed robot observes objects.
/// Cost: the poses of as many tracks as it takes to cover the interval, robots first.
absl::StatusOr<double> ObservedShare(const Snapshot& snapshot, const Interval& during,
                                     const StopCheck& stop);

}  // namespace dsg::query
