// SPDX-License-Identifier: Apache-2.0
// All encounters of a map in the order of time, slice by slice, so that memory is bounded and a
// page costs what it shows. Refuses to let the slices show: the answer is that of one piece.
#pragma once

#include <compare>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/interaction/encounter_scan.h"
#include "query/engine/interaction/sight.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

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
