// SPDX-License-Identifier: Apache-2.0
// How far it is at least from a place to the nearest goal. Refuses to overestimate: what it says
// of two neighbours never differs by more than the link between them is long.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "query/engine/planning/anchor.h"
#include "query/engine/planning/landmarks.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// Threads: one search at a time.
class Guide {
 public:
  /// Straight lines only if `landmarks` is null. The arguments must outlive it.
  /// Requires: at least one goal, and only goals that landmarks have a component for.
  Guide(const PlaceGraph& graph, const std::vector<Anchor>& goals, const Landmarks* landmarks);

  /// False if the place is in no component of a goal. Always true without landmarks.
  bool MayReach(PlaceIndex place) const;
  /// Metres. Requires: MayReach.
  double AtLeast(PlaceIndex place) const;

 private:
  // Goals that are bounded together: exact for one, looser the further apart they are.
  struct Group {
    int32_t component = 0;
    Box3d box;
    double way_m = 0.0;
    Landmarks::Distances low;
    Landmarks::Distances high;
  };

  double StraightFrom(PlaceIndex place, const Group& group) const;
  void Extend(const Anchor& goal, Group* group) const;
  int32_t ComponentOf(PlaceIndex place) const {
    return landmarks_ == nullptr ? 0 : landmarks_->component(place);
  }

  const PlaceGraph& graph_;
  const Landmarks* landmarks_;
  // Ascending component.
  std::vector<Group> groups_;
};

}  // namespace dsg::query
