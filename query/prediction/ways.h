// SPDX-License-Identifier: Apache-2.0
// Shortest ways from where somebody is to all places within reach. One search serves any number of
// goals.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "query/prediction/goal_prediction.h"
#include "query/prediction/route.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

/// Source: Dijkstra 1959; Dial 1969 (buckets). Cost: links within `way_m_max`.
class Ways {
 public:
  /// `from` are the ways onto the graph of `field`. Errors: what `stop` returned.
  static absl::StatusOr<Ways> Find(const std::vector<Attachment>& from, const GoalField& field,
                                   double way_m_max, const StopCheck& stop);
  /// Ends once the ways to all of `wanted` are known: then nothing is promised of other places.
  static absl::StatusOr<Ways> FindThese(const std::vector<Attachment>& from, const GoalField& field,
                                        double way_m_max, const std::vector<int>& wanted,
                                        const StopCheck& stop);

  /// Infinite when there is none, or none that short.
  double WayM(int place) const { return way_m_[place]; }
  bool Reaches(int place) const;
  /// Index of the attachment through which the way to a place begins. Requires: it is reached.
  int Origin(int place) const;
  /// From the attachment's place to `place`. Requires: it is reached.
  std::vector<int> PlacesTo(int place) const;
  /// The same up to the first one whose way is longer than `way_m`.
  std::vector<int> PlacesWithin(int place, double way_m) const;

 private:
  Ways() = default;

  static absl::StatusOr<Ways> Search(const std::vector<Attachment>& from, const GoalField& field,
                                     double way_m_max, const std::vector<int>* wanted,
                                     const StopCheck& stop);

  std::vector<double> way_m_;
  // The place before on the way; -1 - the attachment's index where it begins.
  std::vector<int> before_;
};

}  // namespace dsg::query
