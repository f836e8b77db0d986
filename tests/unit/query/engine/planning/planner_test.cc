// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/planner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "tests/unit/query/engine/planning/random_places.h"

namespace dsg::query {
namespace {

using test::NaiveWay;
using test::RandomAnchors;
using test::RandomLimits;
using test::RandomPlaces;

constexpr double kToleranceM = 1e-9;

struct Question {
  RandomPlaces world;
  Limits limits;
  std::vector<Anchor> from;
  std::vector<Anchor> to;

  explicit Question(uint64_t seed) {
    Random random(seed, 1);
    world = RandomPlaces::Make(&random);
    limits = RandomLimits(world, &random);
    from = RandomAnchors(world, &random);
    to = RandomAnchors(world, &random);
  }
};

const PlaceGraph::Link* LinkBetween(const PlaceGraph& graph, const Limits& limits, PlaceIndex a,
                                    PlaceIndex b) {
  const auto* found = std::find_if(graph.links_begin(a), graph.links_end(a), [&](const auto& link) {
    return link.to == b && limits.Admits(link);
  });
  return found == graph.links_end(a) ? nullptr : found;
}

// The way goes over what is admitted, from a start to a goal, and is as long as it says.
void ExpectSound(const PlaceGraph& graph, const Question& question, const PlaceRoute& route) {
  ASSERT_FALSE(route.places.empty());
  EXPECT_EQ(route.from.place, route.places.front());
  EXPECT_EQ(route.to.place, route.places.back());
  EXPECT_NE(std::find(question.from.begin(), question.from.end(), route.from), question.from.end());
  EXPECT_NE(std::find(question.to.begin(), question.to.end(), route.to), question.to.end());
  double way_m = route.from.way_m + route.to.way_m;
  for (size_t i = 0; i < route.places.size(); ++i) {
    EXPECT_TRUE(question.limits.Admits(graph, route.places[i]));
    if (i == 0) continue;
    const auto* link = LinkBetween(graph, question.limits, route.places[i - 1], route.places[i]);
    ASSERT_NE(link, nullptr);
    way_m += link->length_m;
  }
  EXPECT_NEAR(route.way_m, way_m, kToleranceM);
}

TEST(PlanFlat, FindsTheShortestWayOfRandomGraphs) {
  int found_count = 0;
  for (uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE(seed);
    const Question question(seed);
    const auto graph = question.world.Graph();
    const auto result = PlanFlat(*graph, question.limits, question.from, question.to, {});
    ASSERT_TRUE(result.ok());
    const auto shortest_m = NaiveWay(question.world, question.limits, question.from, question.to);
    ASSERT_EQ(result->route.has_value(), shortest_m.has_value());
    if (!shortest_m.has_value()) continue;
    ++found_count;
    EXPECT_NEAR(result->route->way_m, *shortest_m, kToleranceM);
    ExpectSound(*graph, question, *result->route);
  }
  EXPECT_GT(found_count, 500);
  EXPECT_LT(found_count, 2500);
}

TEST(PlanHierarchical, FindsAWayWheneverThereIsOneAndNoneMuchLonger) {
  for (uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE(seed);
    const Question question(seed);
    const auto graph = question.world.Graph();
    const auto result = PlanHierarchical(*graph, question.limits, question.from, question.to, {});
    ASSERT_TRUE(result.ok());
    const auto shortest_m = NaiveWay(question.world, question.limits, question.from, question.to);
    ASSERT_EQ(result->route.has_value(), shortest_m.has_value());
    if (!shortest_m.has_value()) continue;
    EXPECT_GE(result->route->way_m, *shortest_m - kToleranceM);
    EXPECT_LE(result->route->way_m, kHierarchicalStretchMax * *shortest_m + kToleranceM);
    ExpectSound(*graph, question, *result->route);
  }
}

TEST(Planner, GivesTheSameWayWhateverTheOrderOfTheMap) {
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    const Question question(seed);
    Random random(seed, 2);
    const auto graph = question.world.Graph();
    const auto other = question.world.Shuffled(&random).Graph();
    for (const auto plan : {PlanFlat, PlanHierarchical}) {
      const auto a = plan(*graph, question.limits, question.from, question.to, {});
      const auto b = plan(*other, question.limits, question.from, question.to, {});
      ASSERT_TRUE(a.ok() && b.ok());
      ASSERT_EQ(a->route.has_value(), b->route.has_value());
      EXPECT_EQ(a->expanded_count, b->expanded_count);
      if (a->route.has_value()) {
        EXPECT_EQ(a->route->places, b->route->places);
      }
    }
  }
}

// A line of places, 1 m apart, wide enough for everybody.
std::shared_ptr<const PlaceGraph> Line(int count) {
  RandomPlaces world;
  for (int i = 0; i < count; ++i) {
    PlaceGraph::Place place;
    place.id = NodeId('p', static_cast<uint64_t>(i));
    place.position_map = {static_cast<double>(i), 0.0, 0.0};
    place.clearance_m = 1.0;
    place.room = NodeId('R', static_cast<uint64_t>(i / 100));
    world.places.push_back(place);
    if (i > 0) {
      world.passages.push_back({NodeId('p', static_cast<uint64_t>(i - 1)), place.id, 1.0, {}});
    }
  }
  return world.Graph();
}

TEST(Planner, GoesToTheLowestPlaceOfTwoThatAreEquallyFar) {
  const auto graph = Line(11);
  for (const auto plan : {PlanFlat, PlanHierarchical}) {
    const auto result =
        plan(*graph, {}, {{5, 0.0, {}}}, {{1, 0.0, NodeId('O', 1)}, {9, 0.0, NodeId('O', 9)}}, {});
    ASSERT_TRUE(result.ok() && result->route.has_value());
    EXPECT_EQ(result->route->to.node, NodeId('O', 1));
  }
}

TEST(Planner, StaysWhereItIsWhenTheStartIsTheGoal) {
  const auto graph = Line(3);
  const auto result = PlanHierarchical(*graph, {}, {{1, 0.0, {}}}, {{1, 0.0, {}}}, {});
  ASSERT_TRUE(result.ok() && result->route.has_value());
  EXPECT_EQ(result->route->places, std::vector<PlaceIndex>{1});
  EXPECT_EQ(result->route->way_m, 0.0);
}

TEST(Planner, HasNoWayOnAMapWithoutPlaces) {
  const auto graph = PlaceGraph::Make({}, {});
  for (const auto plan : {PlanFlat, PlanHierarchical}) {
    const auto result = plan(*graph, {}, {}, {}, {});
    ASSERT_TRUE(result.ok());
    EXPECT_FALSE(result->route.has_value());
  }
}

TEST(Planner, StopsInTheMiddleWhenToldTo) {
  const auto graph = Line(20'000);
  int asked = 0;
  const StopCheck stop = [&asked] {
    return ++asked < 5 ? absl::OkStatus() : absl::CancelledError("enough");
  };
  for (const auto plan : {PlanFlat, PlanHierarchical}) {
    asked = 0;
    const auto result = plan(*graph, {}, {{0, 0.0, {}}}, {{19'999, 0.0, {}}}, stop);
    EXPECT_TRUE(absl::IsCancelled(result.status()));
    EXPECT_EQ(asked, 5);
  }
}

TEST(Planner, AnswersManyThreadsAlike) {
  const Question question(17);
  const auto graph = question.world.Graph();
  const auto alone =
      PlanHierarchical(*question.world.Graph(), question.limits, question.from, question.to, {});
  ASSERT_TRUE(alone.ok());
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  for (size_t i = 0; i < wrong.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 50; ++k) {
        // All classes of radius in turn, so that landmarks are measured and forgotten meanwhile.
        Limits limits = question.limits;
        limits.radius_m = 0.07 * ((k + static_cast<int>(i)) % 7);
        if (!PlanHierarchical(*graph, limits, question.from, question.to, {}).ok()) ++wrong[i];
        const auto result =
            PlanHierarchical(*graph, question.limits, question.from, question.to, {});
        const bool same =
            result.ok() && result->route.has_value() == alone->route.has_value() &&
            result->expanded_count == alone->expanded_count &&
            (!alone->route.has_value() || result->route->places == alone->route->places);
        if (!same) ++wrong[i];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

}  // namespace
}  // namespace dsg::query
