// SPDX-License-Identifier: Apache-2.0
// Where a thing that left a spot may have appeared again, and who went there meanwhile.
// Refuses to look at anything but class, size and SAME_AS.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/interaction/object_change.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// The other end of a change: where it appeared, for a picked object; where it left, for a put one.
struct OtherEnd {
  NodeId object;
  Box3d box_map;
  /// First there, or last there.
  TimeNs at_ns = 0;
  NodeId room;
  /// A SAME_AS edge says so; class and size alone otherwise.
  bool is_same_as = false;
  /// Between the boxes.
  double distance_m = 0.0;
};

/// Among `all` changes of the other type, by SAME_AS first, then by time apart. Sizes may differ by
/// half, since a view shows only a part.
std::vector<OtherEnd> FindOtherEnds(const GraphView& view, const ObjectChange& change,
                                    const std::vector<ObjectChange>& all);

/// When the agent was first (for a picked object: at or after `after_ns`) within a metre of a box
/// along the floor, no later than `until_ns`; nullopt if it never was.
absl::StatusOr<std::optional<TimeNs>> FirstVisit(const Snapshot& snapshot, NodeId agent,
                                                 const Box3d& box_map, TimeNs after_ns,
                                                 TimeNs until_ns, const StopCheck& stop);

}  // namespace dsg::query
