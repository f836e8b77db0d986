// SPDX-License-Identifier: Apache-2.0
// When agents met: exact roots of the distance between two paths, on stretches on which both move
// straight. Claims nothing where either path has a gap. All encounters of a map come in the order
// of time, slice by slice, so that memory is bounded; slices do not show in the answer.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/interaction/sight.h"
#include "query/engine/interaction/track_path.h"
#include "schema/store/snapshot.h"

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

/// Compares as the answer is ordered.
struct EncounterKey {
  TimeNs from_ns = kTimeMin;
  NodeId agent;
  NodeId other;
  auto operator<=>(const EncounterKey&) const = default;
};

struct FoundEncounter {
  /// agent < other.
  NodeId agent;
  NodeId other;
  Meeting meeting;

  EncounterKey key() const { return {meeting.during.from_ns, agent, other}; }
};

/// Somebody who passes a pillar or a door frame is still there.
inline constexpr TimeNs kSightGapNs = 2 * kNsPerSecond;

struct EncounterQuestion {
  /// Empty = all pairs.
  NodeId agent;
  /// Empty = with anybody.
  NodeId other;
  Interval during;
  double distance_m = 2.0;
  TimeNs duration_ns_min = 0;
  /// Null = walls do not matter.
  Sight* sight = nullptr;
  /// Out of sight for no longer than this, while near all along, ends no encounter.
  TimeNs sight_gap_ns_max = kSightGapNs;
  /// Only those after this one.
  EncounterKey after;
  /// At least so many, if there are.
  size_t count = 0;
  /// Poses read at a time; smaller ones are for tests.
  int64_t slice_pose_count = 2'000'000;
};

/// Ascending by key; all of them, or the first `count` or more.
/// Errors: of the snapshot; what `stop` returned.
absl::StatusOr<std::vector<FoundEncounter>> FindEncounters(const Snapshot& snapshot,
                                                           const EncounterQuestion& question,
                                                           const StopCheck& stop);

}  // namespace dsg::query
