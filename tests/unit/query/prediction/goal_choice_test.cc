// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/goal_choice.h"

#include <gtest/gtest.h>

namespace dsg::query {
namespace {

/// A place at every metre along x, 0 to 9.
WalkGraph TenPlaces() {
  WalkGraph graph;
  for (int i = 0; i < 10; ++i) graph.places_map.emplace_back(i, 0.5, 1.0);
  graph.clearance_m.assign(10, 0.5);
  return graph;
}

GoalChoiceOptions NowhereElse() {
  GoalChoiceOptions options;
  options.anywhere_prior = 0.0;
  return options;
}

TEST(ChooseGoals, TakesTheNearestPlaceOfTheStorey) {
  WalkGraph graph = TenPlaces();
  graph.places_map.emplace_back(3.1, 0.5, 4.0);
  graph.clearance_m.push_back(0.5);
  const auto goals = ChooseGoals(graph, {{{3.1, 0.5, 0.5}}, {{50, 0, 1}}}, NowhereElse());
  ASSERT_EQ(goals.size(), 1u) << "nothing is near the second one";
  EXPECT_EQ(goals[0].goal.place, 3);
  EXPECT_EQ(goals[0].attraction, 0);
}

TEST(ChooseGoals, LetsTheFirstOfNeighboursStandForAll) {
  const auto goals =
      ChooseGoals(TenPlaces(), {{{3, 0.5, 1}}, {{4, 0.5, 1}}, {{6, 0.5, 1}, 2.0}}, NowhereElse());
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[0].attraction, 0);
  EXPECT_EQ(goals[1].attraction, 2);
  EXPECT_EQ(goals[1].goal.prior, 2.0);
}

TEST(ChooseGoals, FillsTheRestWithPlacesAnywhere) {
  GoalChoiceOptions options;
  options.anywhere_m = 5.0;
  const auto goals = ChooseGoals(TenPlaces(), {{{1, 0.5, 1}}}, options);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[1].attraction, -1);
  EXPECT_GE(goals[1].goal.place, 5) << "the first square has a goal already";
  EXPECT_EQ(goals[1].goal.prior, options.anywhere_prior);
}

TEST(DrawsPeople, GoesByTheLastWord) {
  for (const char* name : {"chair", "office chair", "Dining-Table", "kitchen_sink", "COUCH"}) {
    EXPECT_TRUE(DrawsPeople(name)) << name;
  }
  for (const char* name : {"", "wall", "chairs", "table lamp", "plant", " "}) {
    EXPECT_FALSE(DrawsPeople(name)) << name;
  }
}

}  // namespace
}  // namespace dsg::query
