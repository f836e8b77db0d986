// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/no_path.h"

#include <gtest/gtest.h>

#include "query/engine/planning/planner.h"
#include "tests/unit/query/engine/planning/random_places.h"

namespace dsg::query {
namespace {

using test::RandomPlaces;

TEST(WidestRadius, IsTheLargestThatStillHasAWay) {
  int found_count = 0;
  for (uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 6);
    const RandomPlaces world = RandomPlaces::Make(&random);
    Limits limits = test::RandomLimits(world, &random);
    const std::vector<Anchor> from = test::RandomAnchors(world, &random);
    const std::vector<Anchor> to = test::RandomAnchors(world, &random);
    const auto graph = world.Graph();
    const auto widest_m = WidestRadius(*graph, limits, from, to, {});
    ASSERT_TRUE(widest_m.ok());
    limits.radius_m = widest_m->value_or(0.0);
    EXPECT_EQ(PlanFlat(*graph, limits, from, to, {})->route.has_value(), widest_m->has_value());
    if (!widest_m->has_value()) continue;
    ++found_count;
    limits.radius_m += 1e-6;
    EXPECT_FALSE(PlanFlat(*graph, limits, from, to, {})->route.has_value());
  }
  EXPECT_GT(found_count, 50);
}

// Rooms 1 (x 0 and 2), 2 (x 4 and 6), 3 (x 100); a door of 0.4 m between 1 and 2, there from 5 on.
RandomPlaces TwoRoomsAndAnIsland() {
  RandomPlaces world;
  const double x[] = {0.0, 2.0, 4.0, 6.0, 100.0};
  const uint64_t room[] = {1, 1, 2, 2, 3};
  for (uint64_t i = 0; i < 5; ++i) {
    PlaceGraph::Place place;
    place.id = NodeId('p', i);
    place.position_map = {x[i], 0.0, 0.0};
    place.clearance_m = 0.75;
    place.room = NodeId('R', room[i]);
    world.places.push_back(place);
  }
  world.passages = {{NodeId('p', 0), NodeId('p', 1), 1.0, {}},
                    {NodeId('p', 1), NodeId('p', 2), 0.4, {5, kTimeMax}},
                    {NodeId('p', 2), NodeId('p', 3), 1.0, {}}};
  return world;
}

PathTarget Place(PlaceIndex place) {
  PathTarget target;
  target.places = {place};
  return target;
}

NoPath Explain(const Limits& limits, const PathTarget& from, const PathTarget& to) {
  const auto reason = ExplainNoPath(*TwoRoomsAndAnIsland().Graph(), limits, {from}, {to}, {}, {});
  EXPECT_TRUE(reason.ok());
  return *reason;
}

TEST(ExplainNoPath, SaysHowWideARobotMayBe) {
  Limits limits;
  limits.radius_m = 0.5;
  const NoPath reason = Explain(limits, Place(0), Place(3));
  EXPECT_EQ(reason.cause, NoPathCause::kTooNarrow);
  EXPECT_NEAR(reason.radius_m_max, 0.4, 1e-6);
}

TEST(ExplainNoPath, SaysThatBlockedPlacesAreInTheWay) {
  Limits limits;
  limits.blocked = {0, 1, 0, 0, 0};
  EXPECT_EQ(Explain(limits, Place(0), Place(3)).cause, NoPathCause::kBlocked);
  limits.radius_m = 0.5;
  EXPECT_EQ(Explain(limits, Place(0), Place(3)).cause, NoPathCause::kTooNarrowAndBlocked);
}

TEST(ExplainNoPath, SaysThatTheLinkIsOfAnotherTime) {
  Limits limits;
  limits.at_ns = 4;
  EXPECT_EQ(Explain(limits, Place(0), Place(3)).cause, NoPathCause::kNotAtThatTime);
}

TEST(ExplainNoPath, NamesTheRoomsThatAreApart) {
  const NoPath reason = Explain({}, Place(0), Place(4));
  EXPECT_EQ(reason.cause, NoPathCause::kApart);
  EXPECT_EQ(reason.from_room, NodeId('R', 1));
  EXPECT_EQ(reason.to_room, NodeId('R', 3));
}

TEST(ExplainNoPath, SaysWhichEndHasNoPlace) {
  PathTarget nowhere;
  nowhere.position_map = Eigen::Vector3d(50.0, 50.0, 0.0);
  EXPECT_EQ(Explain({}, nowhere, Place(0)).cause, NoPathCause::kNoPlaceAtStart);
  EXPECT_EQ(Explain({}, Place(0), nowhere).cause, NoPathCause::kNoPlaceAtEnd);
}

}  // namespace
}  // namespace dsg::query
