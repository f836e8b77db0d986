// SPDX-License-Identifier: Apache-2.0
// Only what changed is told, and applied in order it gives what is believed now.
#include "ingest/commit/graph_told.h"

#include <gtest/gtest.h>

#include "schema/base/random.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

Edge MakeEdge(const Node& source, const Node& target, double weight) {
  Edge edge;
  edge.source = source.id;
  edge.relation = relations::kTraversable;
  edge.target = target.id;
  edge.weight = weight;
  return edge;
}

LayerGraph TwoPlaces(double weight) {
  LayerGraph graph;
  graph.nodes = {MakePlace(1, 0, 0), MakePlace(2, 1, 0)};
  graph.edges = {MakeEdge(graph.nodes[0], graph.nodes[1], weight)};
  return graph;
}

TEST(GraphTold, SaysEverythingFirstAndNothingTwice) {
  GraphTold told;
  const GraphDelta first = told.Tell(TwoPlaces(0.5));
  EXPECT_EQ(first.nodes.size(), 2u);
  EXPECT_EQ(first.edges.size(), 1u);
  EXPECT_TRUE(told.Tell(TwoPlaces(0.5)).empty());
}

TEST(GraphTold, SaysWhatChanged) {
  GraphTold told;
  (void)told.Tell(TwoPlaces(0.5));
  LayerGraph moved = TwoPlaces(0.7);
  moved.nodes[1].map_T_node.position.x() = 2.0;
  const GraphDelta delta = told.Tell(moved);
  ASSERT_EQ(delta.nodes.size(), 1u);
  EXPECT_EQ(delta.nodes[0].id, NodeId('p', 2));
  ASSERT_EQ(delta.edges.size(), 1u);
  EXPECT_DOUBLE_EQ(delta.edges[0].weight, 0.7);
}

TEST(GraphTold, TakesBackWhatIsNoLongerBelieved) {
  GraphTold told;
  (void)told.Tell(TwoPlaces(0.5));
  LayerGraph one;
  one.nodes = {MakePlace(1, 0, 0)};
  const GraphDelta delta = told.Tell(one);
  EXPECT_TRUE(delta.nodes.empty());
  ASSERT_EQ(delta.retirements.size(), 1u);
  EXPECT_EQ(delta.retirements[0].id, NodeId('p', 2));
  EXPECT_FALSE(delta.retirements[0].valid_to_ns.has_value());
  EXPECT_EQ(delta.edge_removals.size(), 1u);
}

TEST(GraphTold, DeltasAddUpToWhatIsBelieved) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 1);
    GraphTold told;
    std::map<NodeId, double> stored;
    std::map<EdgeKey, double> stored_edges;
    for (int step = 0; step < 30; ++step) {
      LayerGraph now;
      for (uint64_t i = 1; i <= 10; ++i) {
        if (random.Index(3) != 0) now.nodes.push_back(MakePlace(i, double(random.Index(3)), 0));
      }
      for (size_t i = 1; i < now.nodes.size(); ++i) {
        now.edges.push_back(MakeEdge(now.nodes[i - 1], now.nodes[i], double(random.Index(3))));
      }
      const GraphDelta delta = told.Tell(now);
      for (const EdgeKey& key : delta.edge_removals) stored_edges.erase(key);
      for (const Retirement& item : delta.retirements) stored.erase(item.id);
      for (const Node& node : delta.nodes) stored[node.id] = node.map_T_node.position.x();
      for (const Edge& edge : delta.edges) stored_edges[edge.key()] = edge.weight;
      std::map<NodeId, double> wanted;
      std::map<EdgeKey, double> wanted_edges;
      for (const Node& node : now.nodes) wanted[node.id] = node.map_T_node.position.x();
      for (const Edge& edge : now.edges) wanted_edges[edge.key()] = edge.weight;
      ASSERT_EQ(stored, wanted) << "seed " << seed << ", step " << step;
      ASSERT_EQ(stored_edges, wanted_edges) << "seed " << seed << ", step " << step;
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
