// SPDX-License-Identifier: Apache-2.0
// Random graphs of places, and ways over them found without any of the code under test.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "query/engine/planning/ends.h"
#include "query/view/place_graph.h"
#include "schema/base/random.h"

namespace dsg::test {

/// Places in rooms of several storeys, links that know times and parallel ones, some places of no
/// room, and islands.
struct RandomPlaces {
  std::vector<query::PlaceGraph::Place> places;
  std::vector<query::PlaceGraph::Passage> passages;

  static RandomPlaces Make(Random* random);
  std::shared_ptr<const query::PlaceGraph> Graph() const {
    return query::PlaceGraph::Make(places, passages);
  }
  /// The same lists in another order.
  RandomPlaces Shuffled(Random* random) const;
};

/// Radius, time and blocks.
query::Limits RandomLimits(const RandomPlaces& world, Random* random);
/// One to four places.
std::vector<query::Anchor> RandomAnchors(const RandomPlaces& world, Random* random);

/// Length of the shortest way by relaxing all passages until nothing changes; nullopt if none.
/// Indices count in ascending id, as the places of RandomPlaces stand.
std::optional<double> NaiveWay(const RandomPlaces& world, const query::Limits& limits,
                               const std::vector<query::Anchor>& from,
                               const std::vector<query::Anchor>& to);

}  // namespace dsg::test
