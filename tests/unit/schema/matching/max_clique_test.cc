// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/max_clique.h"

#include <gtest/gtest.h>

#include <vector>

#include "schema/base/random.h"

namespace dsg {
namespace {

BitsetGraph RandomGraph(int vertex_count, double density, Random* random) {
  BitsetGraph graph(vertex_count);
  for (int a = 0; a < vertex_count; ++a) {
    for (int b = a + 1; b < vertex_count; ++b) {
      if (random->Chance(density)) graph.AddEdge(a, b);
    }
  }
  return graph;
}

void Grow(const BitsetGraph& graph, int next, int size, std::vector<int>* members, int* best) {
  if (size > *best) *best = size;
  for (int v = next; v < graph.vertex_count(); ++v) {
    bool is_joined = true;
    for (const int member : *members) is_joined = is_joined && graph.HasEdge(member, v);
    if (!is_joined) continue;
    members->push_back(v);
    Grow(graph, v + 1, size + 1, members, best);
    members->pop_back();
  }
}

// Tries every clique there is.
int LargestByTrying(const BitsetGraph& graph) {
  std::vector<int> members;
  int best = 0;
  Grow(graph, 0, 0, &members, &best);
  return best;
}

void ExpectIsClique(const BitsetGraph& graph, const std::vector<int>& vertices) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    for (size_t j = i + 1; j < vertices.size(); ++j) {
      ASSERT_LT(vertices[i], vertices[j]);
      ASSERT_TRUE(graph.HasEdge(vertices[i], vertices[j]));
    }
  }
}

TEST(MaxClique, IsThatOfTryingEverythingOnThirtyVertices) {
  Random random(11, 0);
  for (int round = 0; round < 400; ++round) {
    const double density = random.Uniform(0.0, 0.85);
    const BitsetGraph graph = RandomGraph(30, density, &random);
    const Clique clique = FindMaxClique(graph, {});
    ASSERT_TRUE(clique.is_maximal);
    ExpectIsClique(graph, clique.vertices);
    ASSERT_EQ(static_cast<int>(clique.vertices.size()), LargestByTrying(graph))
        << "seed 11, round " << round << ", density " << density;
  }
}

TEST(MaxClique, FindsWhatWasPlantedAmongManyVertices) {
  Random random(12, 0);
  BitsetGraph graph = RandomGraph(700, 0.1, &random);
  std::vector<int> planted;
  for (int v = 5; v < 700; v += 50) planted.push_back(v);
  for (const int a : planted) {
    for (const int b : planted) {
      if (a < b) graph.AddEdge(a, b);
    }
  }
  const Clique clique = FindMaxClique(graph, {});
  EXPECT_TRUE(clique.is_maximal);
  EXPECT_EQ(clique.vertices, planted);
}

TEST(MaxClique, OfNothingIsNothingAndOfLonelyVerticesIsOne) {
  EXPECT_TRUE(FindMaxClique(BitsetGraph(0), {}).vertices.empty());
  EXPECT_EQ(FindMaxClique(BitsetGraph(1), {}).vertices, std::vector<int>{0});
  EXPECT_EQ(FindMaxClique(BitsetGraph(70), {}).vertices.size(), 1U);
}

TEST(MaxClique, OfAFullGraphIsAllOfItAtOnce) {
  Random random(13, 0);
  const BitsetGraph graph = RandomGraph(300, 2.0, &random);
  const Clique clique = FindMaxClique(graph, {});
  EXPECT_TRUE(clique.is_maximal);
  EXPECT_EQ(clique.vertices.size(), 300U);
}

TEST(MaxClique, SearchesOnlyAboveTheSizeThatIsKnown) {
  Random random(14, 0);
  const BitsetGraph graph = RandomGraph(60, 0.5, &random);
  const int size = static_cast<int>(FindMaxClique(graph, {}).vertices.size());
  EXPECT_EQ(static_cast<int>(FindMaxClique(graph, {.size_above = size - 1}).vertices.size()), size);
  const Clique none = FindMaxClique(graph, {.size_above = size});
  EXPECT_TRUE(none.is_maximal);
  EXPECT_TRUE(none.vertices.empty());
}

TEST(MaxClique, SaysWhenItWasCutOffAndStillGivesAClique) {
  Random random(15, 0);
  const BitsetGraph graph = RandomGraph(200, 0.9, &random);
  const Clique clique = FindMaxClique(graph, {.step_count_max = 30'000});
  EXPECT_FALSE(clique.is_maximal);
  EXPECT_GT(clique.vertices.size(), 20U);
  ExpectIsClique(graph, clique.vertices);
  // One row of work may be begun before the limit is looked at.
  EXPECT_LT(clique.step_count, 30'000 + 2'000);
}

TEST(MaxClique, ForgetsVerticesThatWereIsolated) {
  BitsetGraph graph(100);
  for (const int a : {3, 40, 99}) {
    for (const int b : {3, 40, 99}) {
      if (a < b) graph.AddEdge(a, b);
    }
  }
  EXPECT_EQ(graph.EdgeCount(), 3);
  graph.Isolate(40);
  EXPECT_EQ(graph.EdgeCount(), 1);
  EXPECT_EQ(FindMaxClique(graph, {}).vertices, (std::vector<int>{3, 99}));
}

TEST(Degeneracy, GivesTheCoresOfAKnownGraph) {
  // A square with one diagonal, a tail, and a lonely vertex.
  BitsetGraph graph(6);
  graph.AddEdge(0, 1);
  graph.AddEdge(1, 2);
  graph.AddEdge(2, 3);
  graph.AddEdge(3, 0);
  graph.AddEdge(0, 2);
  graph.AddEdge(3, 4);
  EXPECT_EQ(FindDegeneracy(graph).core, (std::vector<int>{2, 2, 2, 2, 1, 0}));
}

}  // namespace
}  // namespace dsg
