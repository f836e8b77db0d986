// SPDX-License-Identifier: Apache-2.0
// Objects that left a spot or appeared on one: when at the earliest and at the latest, with whom
// they were seen on their way, and where they may have appeared again.
#pragma once

#include <compare>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/view/graph_view.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Same numbers as v1.InteractionType.
enum class ChangeType { kPicked = 1, kPlaced = 2 };

/// Something became otherwise between the last time that it was seen as it had been and the first
/// time that it was seen otherwise.
struct ObjectChange {
  ChangeType type = ChangeType::kPicked;
  NodeId object;
  std::string name;
  std::string class_name;
  Box3d box_map;
  /// Above the object at that time, nearest first.
  std::vector<NodeId> ancestors;
  /// The first of `ancestors` among the rooms; may be empty.
  NodeId room;
  /// earliest_ns < latest_ns.
  TimeNs earliest_ns = 0;
  TimeNs latest_ns = 0;
  int64_t observation_count = 0;
  /// Its spot is one that a robot passes, and looks at only then.
  bool is_passed_by = false;
};

/// Compares as the answer is ordered. An object may be put and picked.
struct ChangeKey {
  TimeNs earliest_ns = kTimeMin;
  NodeId object;
  ChangeType type = ChangeType::kPicked;
  auto operator<=>(const ChangeKey&) const = default;
};

inline ChangeKey KeyOf(const ObjectChange& change) {
  return {change.earliest_ns, change.object, change.type};
}

struct ChangeFilter {
  Interval during;
  /// Empty = any.
  NodeId object;
  std::string class_name;
  /// Above the object at that time, or the object itself; empty = any.
  NodeId below;
  bool with_picked = true;
  bool with_placed = true;
};

/// Changes whose interval touches the filter's, ascending by KeyOf.
/// Picked: the object's validity ended; from its last observation on.
/// Placed: its validity began at least 10 s (two updates of a mapper) after its place was first
/// known, or after the map's first pose where the place has no begin; and, in a map that a robot
/// made, after the robot first came within 4 m of it, since from farther small things are
/// overlooked.
absl::StatusOr<std::vector<ObjectChange>> FindChanges(const Snapshot& snapshot,
                                                      const GraphView& view,
                                                      const ChangeFilter& filter,
                                                      const StopCheck& stop);

struct Hold {
  NodeId agent;
  /// The object of the change, or what that was before by SAME_AS.
  NodeId object;
  /// That the thing was this object, above 0.5.
  double probability = 0.0;
  Interval during;
};

/// Of a picked object: holds that began while it went, or until 30 s after it was missed. Of a put
/// one: holds that ended while it came, or at most 30 s before. The likeliest of each agent.
/// Order: by agent.
std::vector<Hold> FindHolds(const GraphView& view, const ObjectChange& change);

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
