// SPDX-License-Identifier: Apache-2.0
// The ends of a path: what a robot may use (limits), what an end means (targets), and how it gets
// onto the places (anchors). From where nobody has seen free space there is no way.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/view/graph_view.h"
#include "query/view/place_graph.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// The instant at which exactly what has no known end is there.
inline constexpr TimeNs kPresent = kTimeMax - 1;

/// Places looked at between two questions to a StopCheck.
inline constexpr int64_t kPlacesPerStop = 1024;

/// The places and links that a robot may use: wide enough, there at the time, not blocked.
struct Limits {
  /// At least 0, finite.
  double radius_m = 0.0;
  TimeNs at_ns = kPresent;
  /// All that ever was; at_ns then means nothing.
  bool any_time = false;
  /// One entry a place, or none at all: not 0 = the place may not be used.
  std::vector<uint8_t> blocked;

  bool Admits(const PlaceGraph& graph, PlaceIndex place) const {
    return graph.clearance_m(place) >= radius_m && Holds(graph.valid(place)) &&
           (blocked.empty() || blocked[static_cast<size_t>(place)] == 0);
  }
  /// Of the link alone; whether the places at its ends may be used is another question.
  bool Admits(const PlaceGraph::Link& link) const {
    return link.clearance_m >= static_cast<float>(radius_m) && Holds(link.valid);
  }
  bool Holds(const Interval& valid) const { return any_time || valid.Contains(at_ns); }
};

/// A place where a way may begin or end.
struct Anchor {
  PlaceIndex place = 0;
  /// From the place straight to what is meant, metres; counts when ways are compared.
  double way_m = 0.0;
  /// Which of the things that are meant; empty for a position.
  NodeId node;
  /// What is meant has a position, but the way between there and the place is not known to be free.
  bool is_apart = false;

  bool operator==(const Anchor&) const = default;
};

/// Ascending place, one entry a place: the shortest way, then the lowest node.
void SortAnchors(std::vector<Anchor>* anchors);

/// A way over the places.
struct PlaceRoute {
  /// At least one.
  std::vector<PlaceIndex> places;
  Anchor from;
  Anchor to;
  /// Over the places and the ways of both anchors, metres.
  double way_m = 0.0;
};

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

/// What a question knows of the map.
struct PathWorld {
  const GraphView& view;
  const Snapshot& snapshot;
  const PlaceGraph& places;
  /// World time of agents; unset: at the ends of their tracks.
  std::optional<TimeNs> at_ns;
  /// Ends long walks down the hierarchy.
  const StopCheck& stop;
};

/// A place is itself; an agent is where it was, or near there if it is in the way; a node above
/// places is all of them; anything else is its box. Errors: OUT_OF_RANGE/TIME_OUTSIDE_TRACK for an
/// agent that was not seen then; what the world's `stop` returned.
absl::StatusOr<PathTarget> TargetOf(const PathWorld& world, const ViewNode& node);

bool IsAgent(const GraphView& view, const ViewNode& node);

/// Marks the place, or all places below the node. False if the node is neither a place nor of a
/// layer above places. Errors: what the world's `stop` returned.
absl::StatusOr<bool> Block(const PathWorld& world, const ViewNode& node,
                           std::vector<uint8_t>* blocked);

}  // namespace dsg::query
