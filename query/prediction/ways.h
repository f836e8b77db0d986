// SPDX-License-Identifier: Apache-2.0
// Shortest ways from where somebody is to all places within reach.
// Refuses to know goals: one search serves as many of them as there are.
#pragma once

#include <vector>

#include "query/prediction/prediction.h"
#include "query/prediction/route.h"

namespace dsg::query {

/// Source: Dijkstra 1959. Cost: (links log places) within `way_m_max`.
class Ways {
 public:
  /// `from` are the ways onto the graph of `field`.
  Ways(const std::vector<Attachment>& from, const GoalField& field, double way_m_max);

  /// Infinite when there is none, or none that short.
  double WayM(int place) const { return way_m_[place]; }
  bool Reaches(int place) const { return origin_[place] >= 0; }
  /// Index of the attachment through which the way to a place begins. Requires: it is reached.
  int Origin(int place) const { return origin_[place]; }
  /// From the attachment's place to `place`. Requires: it is reached.
  std::vector<int> PlacesTo(int place) const;
  /// The same up to the first one whose way is longer than `way_m`.
  std::vector<int> PlacesWithin(int place, double way_m) const;

 private:
  std::vector<double> way_m_;
  std::vector<int> before_;
  std::vector<int> origin_;
};

}  // namespace dsg::query
