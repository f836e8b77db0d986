// SPDX-License-Identifier: Apache-2.0
// The shortest way over the places from any of some to any of others, exactly or nearly. no_path.h
// explains why there is none.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/ends.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// The longest that a hierarchical way is, as a multiple of the shortest.
inline constexpr double kHierarchicalStretchMax = 1.03;

struct PlanResult {
  /// nullopt: there is no way.
  std::optional<PlaceRoute> route;
  /// Places looked at.
  int64_t expanded_count = 0;
};

/// A* with straight lines as guide. Of ways of equal length the one to the lowest place wins.
/// Anchors must be as SortAnchors leaves them; those that the limits do not admit are ignored.
/// Errors: what `stop` returned, asked every 1024 places.
absl::StatusOr<PlanResult> PlanFlat(const PlaceGraph& graph, const Limits& limits,
                                    const std::vector<Anchor>& from, const std::vector<Anchor>& to,
                                    const StopCheck& stop);

/// Rooms first: those from which no way leads to a goal are left out. Then the places of the
/// others, drawn to the goal by what is known of ways from far places (see landmarks.h). Finds a
/// way whenever there is one, at most 3 % longer than the shortest.
///
/// Cost: the first question of a graph, a class of radius and the present (or any past) measures
/// the landmarks, some ten times what PlanFlat may cost.
/// Source: the bound is that of weighted A*; Pohl, "First results on the effect of error in
/// heuristic search", Machine Intelligence 5, 1970.
absl::StatusOr<PlanResult> PlanHierarchical(const PlaceGraph& graph, const Limits& limits,
                                            const std::vector<Anchor>& from,
                                            const std::vector<Anchor>& to, const StopCheck& stop);

}  // namespace dsg::query
