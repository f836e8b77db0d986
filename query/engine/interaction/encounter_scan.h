// SPDX-License-Identifier: Apache-2.0
// When two paths were closer than a distance: exact roots of the quadratic on each stretch on which
// both move straight. Refuses to claim anything where either path has a gap.
#pragma once

#include <cstdint>
#include <vector>

#include "query/engine/interaction/track_path.h"

namespace dsg::query {

/// During [during.from_ns, during.to_ns) the distance is below the limit.
struct Meeting {
  Interval during;
  /// Least distance on that interval, its end included, and the first instant at which it is had
  /// (the last nanosecond of the interval for its end).
  double distance_m_min = 0.0;
  TimeNs closest_ns = 0;
  Eigen::Vector3d middle_map = Eigen::Vector3d::Zero();
};

/// Meetings of two paths within `during`, ascending. Neighbouring ones are joined.
/// Cost: one quadratic for each pose of either path within `during`.
std::vector<Meeting> FindMeetings(const TrackPath& a, const TrackPath& b, const Interval& during,
                                  double distance_m);

/// Appends `next`, which begins no earlier than the last of `meetings` ends; joins them if it
/// begins just there.
void JoinMeeting(const Meeting& next, std::vector<Meeting>* meetings);

/// Two paths that may have met during an interval: their boxes came near.
struct MeetingCandidate {
  /// Indices of paths, first < second by agent id.
  int32_t first = 0;
  int32_t second = 0;
  Interval during;
};

/// Every meeting within `during` lies in candidates' intervals; those of one pair do not overlap.
/// `only` >= 0: pairs of that path alone. Order: first, second, from_ns.
/// Cost: pieces of 32 poses, swept by time; n log n in these where few are near at a time.
std::vector<MeetingCandidate> FindCandidates(const std::vector<TrackPath>& paths,
                                             const Interval& during, double distance_m, int only);

}  // namespace dsg::query
