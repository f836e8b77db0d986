// SPDX-License-Identifier: Apache-2.0
// Keeps the stays of a log true to rooms and places that were told apart while it ran.
// Refuses to change when a stay began and ended: only where it was.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/presence/region_index.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// Of an ended stay it keeps one position, in the middle, and no poses before its end: some 150
/// bytes a stay.
///
/// Threads: one caller at a time.
class StayMender {
 public:
  /// Requires: times strictly grow per agent.
  void Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map);

  /// Takes note of stays that were told. Requires: the poses of ended ones were observed, and the
  /// stays of an agent end in order.
  void Remember(const std::vector<Stay>& stays);

  /// The path that agents were seen from has moved: positions move by their times.
  void Move(const std::function<Pose3d(TimeNs)>& new_T_old);

  /// The ended stays whose room or place is not in `regions` any more, whose place is in another
  /// room by now, or which had no room: where
  /// the agent was in the middle of each, by `regions`. Counts as told. Order: agent, enter_ns.
  std::vector<Stay> Mend(const RegionIndex& regions);

 private:
  struct Seen {
    TimeNs time_ns;
    Eigen::Vector3d position_map;
  };
  struct Told {
    Stay stay;
    /// Of the agent in the middle of the stay, once that has ended; unset when it was not seen.
    std::optional<Eigen::Vector3d> middle_map;
  };
  std::optional<Eigen::Vector3d> MiddleOf(const Stay& stay) const;
  void ForgetBefore(NodeId agent, TimeNs time_ns);

  /// Since the end of each agent's last stay.
  std::map<NodeId, std::deque<Seen>> seen_;
  std::map<std::pair<NodeId, TimeNs>, Told> told_;
};

}  // namespace dsg::ingest
