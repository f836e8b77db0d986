// SPDX-License-Identifier: Apache-2.0
// How an end of a path - a point, a thing, a room - gets onto the places.
// Refuses to reach far: who stands where nobody has seen free space has no way.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/anchor.h"
#include "query/engine/planning/limits.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// Places further from a point or thing than this are not tried, unless their clearance says that
/// nothing is between.
inline constexpr double kAttachM = 1.5;
/// Places this much higher or lower may be of another storey.
inline constexpr double kStoreyM = 1.5;

/// One of the things that an end of a path may mean.
struct PathTarget {
  /// Empty for a position.
  NodeId node;
  /// Where the way begins or ends; it leads straight from there to the first place.
  std::optional<Eigen::Vector3d> position_map;
  /// A thing that the way leads to: the last place is near, the thing itself is in the way. With a
  /// position too: what to do if nobody gets straight there.
  std::optional<Box3d> box_map;
  /// Of the thing; its places go before those of other rooms. Empty if unknown.
  NodeId room;
  /// What neither position nor box says: any of these places.
  std::vector<PlaceIndex> places;
};

/// Whether a robot comes straight from one point to another, as far as the map knows.
using LineCheck = std::function<absl::StatusOr<bool>(const Eigen::Vector3d& from_map,
                                                     const Eigen::Vector3d& to_map)>;

/// Places to begin or end at, of all targets, as SortAnchors leaves them. Empty if none is near.
///
/// To a position, the first of these that there are, nearest first, then by id:
/// 1. up to 4 places from which a robot of the radius comes straight there within the clearance of
///    the place or of one of its links;
/// 2. up to 4 places of the storey of which the same is true at their own height: people's torsos
///    and maps of flat ground have heights of their own;
/// 3. up to 4 places whose clearance reaches over the position, at its height or at their own;
/// 4. the nearest place of the storey within kAttachM of horizontal distance.
/// Of 3 and 4 only those that `is_free` has nothing against count, if there is an `is_free`.
/// To a thing, up to 4 places of the storey within kAttachM or their clearance of its box,
/// horizontally; those of its room if there are any.
/// Errors: what `stop` or `is_free` returned.
absl::StatusOr<std::vector<Anchor>> Attach(const PlaceGraph& graph, const Limits& limits,
                                           const std::vector<PathTarget>& targets,
                                           const LineCheck& is_free, const StopCheck& stop);

}  // namespace dsg::query
