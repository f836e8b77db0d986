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
  /// When the mapper knew of it.
  TimeNs noticed_ns = 0;
  NodeId room;
  /// A SAME_AS edge says so; class and size alone otherwise.
  bool is_same_as = false;
  /// Somebody was seen with it in hand, before it came or when it went.
  bool is_held = false;
  /// Between the boxes.
  double distance_m = 0.0;
  /// Who was within a metre of the box along the floor, between the change and this.
  std::vector<BoxVisit> visits;
};

/// Among `all` changes of the other type, by SAME_AS first, then by time apart; the first few.
/// Sizes may differ by half, since a view shows only a part. Left out: what came from, or became,
/// another object by SAME_AS.
absl::StatusOr<std::vector<OtherEnd>> FindOtherEnds(const Snapshot& snapshot, const GraphView& view,
                                                    const ObjectChange& change,
                                                    const std::vector<ObjectChange>& all,
                                                    const StopCheck& stop);

/// When the agent was first there, from `after_ns` to `until_ns`; nullopt if it never was.
std::optional<TimeNs> FirstVisit(const OtherEnd& end, NodeId agent, TimeNs after_ns,
                                 TimeNs until_ns);

}  // namespace dsg::query
