// SPDX-License-Identifier: Apache-2.0
// Turns poses into stays: who was in which room and place, from when to when.
// Refuses to know about deltas: what it says depends on the poses only, not on when it is asked.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "ingest/presence/region_index.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// Stays are half-open: the pose that is first elsewhere ends one stay and begins the next. A gap
/// longer than `gap_ns_max` ends a stay 1 ns after the last pose before it, and so does the end
/// of the log. Stays are cut at kStayNsMax. Nowhere is no stay.
///
/// Threads: one caller at a time.
class StayTracker {
 public:
  StayTracker(RegionIndex regions, TimeNs gap_ns_max)
      : regions_(std::move(regions)), gap_ns_max_(gap_ns_max) {}

  /// Requires: times strictly grow per agent.
  void Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map);

  /// From here on rooms and places are those of `regions`. Stays in what is no longer there, or
  /// was moved to another room, end 1 ns after their last pose; if the next pose comes without a
  /// gap, the stay that it is in begins there.
  void SetRegions(RegionIndex regions);

  /// Closes all stays: no pose will follow.
  void Finish();

  /// The stays that ended or began since the last call, open ones with exit_ns = kTimeMax.
  /// Order: ascending agent, then enter_ns.
  std::vector<Stay> TakeChanges();

 private:
  struct Track {
    RegionState where;
    bool has_pose = false;
    bool is_open = false;
    bool is_open_told = false;
    TimeNs enter_ns = 0;
    TimeNs last_ns = 0;
    /// Since when the agent is where its next pose will say.
    std::optional<TimeNs> resumes_ns;
  };

  void Begin(NodeId agent, TimeNs enter_ns, Track* track);
  void Cut(NodeId agent, TimeNs until_ns, bool is_until_inside, Track* track);
  void End(NodeId agent, TimeNs exit_ns, Track* track);
  Stay MakeStay(NodeId agent, const Track& track, TimeNs exit_ns) const;

  RegionIndex regions_;
  TimeNs gap_ns_max_;
  std::unordered_map<NodeId, Track> tracks_;
  std::vector<Stay> ended_;
  /// Agents whose open stay is new; may repeat, and the stay may have ended meanwhile.
  std::vector<NodeId> begun_;
};

}  // namespace dsg::ingest
