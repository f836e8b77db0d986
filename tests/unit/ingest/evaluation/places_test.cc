// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/places.h"

#include <gtest/gtest.h>

namespace dsg::evaluation {
namespace {

// Two rooms of 4 x 4 m beside each other, a 1 m wide door at y = 0.5 to 1.5 in the wall between.
truth::FreeGrid TwoRooms() {
  truth::FreeGrid grid;
  grid.cell_m = 0.1;
  grid.width = 83;
  grid.height = 42;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const bool is_border = x == 0 || y == 0 || x == 82 || y == 41;
      const bool is_door = y >= 6 && y < 16;
      const bool is_wall = x == 41 && !is_door;
      grid.cells.push_back(is_border || is_wall ? truth::kCellObserved
                                                : truth::kCellFree | truth::kCellObserved);
    }
  }
  return grid;
}

/// Places on a lattice of 1 m, edges to the neighbours, and through the door.
struct Graph {
  std::vector<EstimatedPlace> places;
  std::vector<PlaceEdge> edges;
};

Graph Lattice() {
  Graph graph;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double x = 0.6 + i + (i >= 4 ? 0.1 : 0.0);
      graph.places.push_back({{x, 0.6 + j, 0.5}, 0.5});
      const int index = 4 * i + j;
      if (j > 0) graph.edges.emplace_back(index, index - 1);
      if (i > 0 && i != 4) graph.edges.emplace_back(index, index - 4);
      if (i > 0 && i != 4 && j > 0) graph.edges.emplace_back(index, index - 5);
      if (i > 0 && i != 4 && j < 3) graph.edges.emplace_back(index, index - 3);
    }
  }
  graph.places.push_back({{4.15, 1.1, 0.5}, 0.5});
  for (const int neighbour : {12, 13, 16, 17}) graph.edges.emplace_back(32, neighbour);
  return graph;
}

PlaceResult ScorePlaces(const Graph& graph) {
  const truth::FreeGrid grid = TwoRooms();
  const GridMap map(&grid);
  return EvaluatePlaces(graph.places, graph.edges, map, {});
}

TEST(PlaceMetric, IsGoodForADenseLattice) {
  const PlaceResult result = ScorePlaces(Lattice());
  EXPECT_DOUBLE_EQ(*result.collision_free_ratio, 1.0);
  EXPECT_DOUBLE_EQ(*result.coverage, 1.0);
  EXPECT_DOUBLE_EQ(*result.connectivity, 1.0);
  EXPECT_LT(*result.stretch_median, 1.2);
  EXPECT_GT(*result.stretch_median, 0.9);
  EXPECT_NEAR(*result.per_100_m2, 100.0 * 33 / 32.5, 3.0);
  EXPECT_EQ(result.pair_count, 200);
}

TEST(PlaceMetric, CountsEdgesThroughWallsOnceAndDoesNotWalkThem) {
  Graph graph = Lattice();
  const size_t before = graph.edges.size();
  // Cut the door and go through the wall instead.
  std::erase_if(graph.edges, [](const PlaceEdge& edge) { return edge.first == 32; });
  for (const int j : {2, 3}) {
    graph.edges.emplace_back(12 + j, 16 + j);
    graph.edges.emplace_back(16 + j, 12 + j);
  }
  const PlaceResult result = ScorePlaces(graph);
  EXPECT_EQ(result.edge_count, static_cast<int64_t>(before - 4 + 2));
  EXPECT_NEAR(*result.collision_free_ratio, 1.0 - 2.0 / static_cast<double>(before - 2), 1e-12);
  EXPECT_LT(*result.connectivity, 0.85);
}

TEST(PlaceMetric, ShowsThatARoomHasNoPlaces) {
  Graph graph = Lattice();
  graph.places.resize(16);
  std::erase_if(graph.edges,
                [](const PlaceEdge& edge) { return edge.first >= 16 || edge.second >= 16; });
  const PlaceResult result = ScorePlaces(graph);
  EXPECT_LT(*result.coverage, 0.8);
  EXPECT_GT(*result.coverage, 0.45);
  EXPECT_LT(*result.connectivity, 0.75);
}

TEST(PlaceMetric, ShowsDetours) {
  Graph snake = Lattice();
  // Up and down the columns instead of across.
  std::erase_if(snake.edges, [](const PlaceEdge& edge) {
    if (edge.first == 32) return false;
    const int column = edge.first / 4;
    if (column == edge.second / 4) return false;
    const bool at_top = edge.first % 4 == 3 && edge.second % 4 == 3;
    const bool at_bottom = edge.first % 4 == 0 && edge.second % 4 == 0;
    return column % 2 == 1 ? !at_top : !at_bottom;
  });
  EXPECT_GT(*ScorePlaces(snake).stretch_median, *ScorePlaces(Lattice()).stretch_median + 0.05);
}

TEST(PlaceMetric, IsEmptyWithoutPlacesAndHasNoWaysWithoutEdges) {
  EXPECT_FALSE(ScorePlaces({}).coverage.has_value());
  Graph graph = Lattice();
  graph.edges.clear();
  const PlaceResult result = ScorePlaces(graph);
  EXPECT_DOUBLE_EQ(*result.coverage, 1.0);
  EXPECT_FALSE(result.collision_free_ratio.has_value());
  EXPECT_FALSE(result.stretch_median.has_value());
  EXPECT_FALSE(result.connectivity.has_value());
}

TEST(PlaceMetric, TakesPlacesInWallsForUseless) {
  Graph graph = Lattice();
  for (EstimatedPlace& place : graph.places) place.position_map.x() += 100.0;
  const PlaceResult result = ScorePlaces(graph);
  EXPECT_DOUBLE_EQ(*result.collision_free_ratio, 0.0);
  EXPECT_DOUBLE_EQ(*result.coverage, 0.0);
  EXPECT_FALSE(result.stretch_median.has_value());
  EXPECT_DOUBLE_EQ(*result.connectivity, 0.0);
}

}  // namespace
}  // namespace dsg::evaluation
