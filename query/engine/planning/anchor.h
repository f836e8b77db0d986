// SPDX-License-Identifier: Apache-2.0
// Where a way over the places begins or ends, and what was found between.
#pragma once

#include <cstdint>
#include <vector>

#include "query/view/place_graph.h"

namespace dsg::query {

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

}  // namespace dsg::query
