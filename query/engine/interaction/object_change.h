// SPDX-License-Identifier: Apache-2.0
// Objects that left a spot or appeared on one, and when at the earliest and at the latest.
// Refuses to say who did it.
#pragma once

#include <compare>
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

}  // namespace dsg::query
