// SPDX-License-Identifier: Apache-2.0
#include "query/view/place_graph.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/query/engine/planning/random_places.h"

namespace dsg::query {
namespace {

PlaceGraph::Place PlaceOnX(uint64_t number, double x, double clearance_m) {
  PlaceGraph::Place place;
  place.id = NodeId('p', number);
  place.position_map = {x, 0.0, 0.0};
  place.clearance_m = clearance_m;
  return place;
}

TEST(PlaceGraph, LinksAreAsNarrowAsTheirNarrowestPart) {
  const auto graph = PlaceGraph::Make(
      {PlaceOnX(1, 0.0, 0.5), PlaceOnX(2, 3.0, 0.25), PlaceOnX(3, 4.0, 2.0)},
      {{NodeId('p', 1), NodeId('p', 2), 1.0, {}}, {NodeId('p', 3), NodeId('p', 1), 0.125, {}}});
  ASSERT_EQ(graph->links_end(0) - graph->links_begin(0), 2);
  const PlaceGraph::Link* link = graph->links_begin(0);
  EXPECT_EQ(link[0].to, 1);
  EXPECT_EQ(link[0].clearance_m, 0.25F);
  EXPECT_EQ(link[0].length_m, 3.0);
  EXPECT_EQ(link[1].to, 2);
  EXPECT_EQ(link[1].clearance_m, 0.125F);
}

TEST(PlaceGraph, LeavesOutLinksToItselfAndToNowhere) {
  const auto graph = PlaceGraph::Make({PlaceOnX(1, 0.0, 0.5), PlaceOnX(2, 3.0, 0.25)},
                                      {{NodeId('p', 1), NodeId('p', 1), 1.0, {}},
                                       {NodeId('p', 1), NodeId('p', 7), 1.0, {}},
                                       {NodeId('O', 1), NodeId('p', 2), 1.0, {}}});
  EXPECT_EQ(graph->links_begin(0), graph->links_end(1));
}

TEST(PlaceGraph, FindsPlacesWhateverGapsTheirIdsHave) {
  const auto graph = PlaceGraph::Make({PlaceOnX(9, 0.0, 1.0), PlaceOnX(2, 1.0, 1.0),
                                       PlaceOnX(3, 2.0, 1.0), PlaceOnX(1'000'000, 3.0, 1.0)},
                                      {});
  ASSERT_EQ(graph->size(), 4);
  for (PlaceIndex place = 0; place < graph->size(); ++place) {
    EXPECT_EQ(graph->Find(graph->id(place)), place);
  }
  for (const NodeId id : {NodeId(), NodeId('p', 1), NodeId('p', 4), NodeId('p', 10),
                          NodeId('p', 2'000'000), NodeId('O', 3)}) {
    EXPECT_FALSE(graph->Find(id).has_value());
  }
}

TEST(PlaceGraph, LinksCountInBothDirections) {
  Random random(3, 5);
  const auto graph = test::RandomPlaces::Make(&random).Graph();
  for (PlaceIndex place = 0; place < graph->size(); ++place) {
    EXPECT_TRUE(std::is_sorted(graph->links_begin(place), graph->links_end(place),
                               [](const auto& a, const auto& b) { return a.to < b.to; }));
    for (const auto* link = graph->links_begin(place); link != graph->links_end(place); ++link) {
      EXPECT_TRUE(std::any_of(graph->links_begin(link->to), graph->links_end(link->to),
                              [&](const auto& back) {
                                return back.to == place && back.valid == link->valid &&
                                       back.clearance_m == link->clearance_m;
                              }));
    }
  }
}

}  // namespace
}  // namespace dsg::query
