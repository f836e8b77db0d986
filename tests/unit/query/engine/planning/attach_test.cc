// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/ends.h"

#include <gtest/gtest.h>

#include <cmath>

#include "query/engine/planning/planning_annex.h"
#include "tests/unit/query/engine/planning/random_places.h"

namespace dsg::query {
namespace {

PlaceGraph::Place PlaceAt(uint64_t number, const Eigen::Vector3d& position_map, double clearance_m,
                          uint64_t room = 1) {
  return {NodeId('p', number), position_map, clearance_m, {}, NodeId('R', room)};
}

std::vector<Anchor> AttachTo(const PlaceGraph& graph, const PathTarget& target,
                             double radius_m = 0.0) {
  Limits limits;
  limits.radius_m = radius_m;
  const auto anchors = Attach(graph, limits, {target}, {}, {});
  EXPECT_TRUE(anchors.ok());
  return *anchors;
}

std::vector<PlaceIndex> PlacesOf(const std::vector<Anchor>& anchors) {
  std::vector<PlaceIndex> places;
  for (const Anchor& anchor : anchors) places.push_back(anchor.place);
  return places;
}

PathTarget Position(double x, double y, double z) {
  PathTarget target;
  target.position_map = Eigen::Vector3d(x, y, z);
  return target;
}

using Indices = std::vector<PlaceIndex>;

TEST(Attach, PrefersAWideFarPlaceToANearOneThatDoesNotReach) {
  const auto graph =
      PlaceGraph::Make({PlaceAt(0, {0, 0, 0}, 0.25), PlaceAt(1, {3, 0, 0}, 3.0)}, {});
  EXPECT_EQ(PlacesOf(AttachTo(*graph, Position(0.5, 0, 0))), Indices{1});
  EXPECT_EQ(AttachTo(*graph, Position(0.5, 0, 0)).front().way_m, 2.5);
}

TEST(Attach, TakesBothEndsOfALinkThatPassesBeside) {
  const auto graph = PlaceGraph::Make({PlaceAt(0, {0, 0, 0}, 0.5), PlaceAt(1, {8, 0, 0}, 0.5)},
                                      {{NodeId('p', 0), NodeId('p', 1), 0.5, {}}});
  EXPECT_EQ(PlacesOf(AttachTo(*graph, Position(4, 0.25, 0), 0.25)), (Indices{0, 1}));
  EXPECT_TRUE(AttachTo(*graph, Position(4, 0.26, 0), 0.25).empty());
}

TEST(Attach, ReachesNoFurtherThanItsBoundWithoutClearance) {
  const auto graph =
      PlaceGraph::Make({PlaceAt(0, {0, 0, 0}, 0.25), PlaceAt(1, {0, 2.0, 0}, 0.25)}, {});
  EXPECT_EQ(PlacesOf(AttachTo(*graph, Position(0, 0.9, 0))), Indices{0});
  EXPECT_EQ(PlacesOf(AttachTo(*graph, Position(1.5, 0, 0))), Indices{0});
  EXPECT_TRUE(AttachTo(*graph, Position(1.51, 0, 0)).empty());
}

TEST(Attach, FindsTheFloorBelowATorsoButNotTheStoreyBelow) {
  const auto graph = PlaceGraph::Make({PlaceAt(0, {0, 0, 0}, 0.5)}, {});
  EXPECT_EQ(PlacesOf(AttachTo(*graph, Position(0.3, 0, 1.1))), Indices{0});
  EXPECT_TRUE(AttachTo(*graph, Position(0.3, 0, 3.1)).empty());
}

TEST(Attach, LeavesOutPlacesThatAreTooNarrowForTheRobot) {
  const auto graph =
      PlaceGraph::Make({PlaceAt(0, {0, 0, 0}, 0.25), PlaceAt(1, {1, 0, 0}, 0.5)}, {});
  EXPECT_EQ(PlacesOf(AttachTo(*graph, Position(0.1, 0, 0), 0.4)), Indices{1});
}

TEST(Attach, GoesToAThingFromItsOwnRoom) {
  const auto graph =
      PlaceGraph::Make({PlaceAt(0, {0, 0, 0}, 0.25, 1), PlaceAt(1, {2, 0, 0}, 0.25, 2)}, {});
  PathTarget cup;
  cup.node = NodeId('O', 1);
  cup.box_map = Box3d(Eigen::Vector3d(0.8, -0.1, 0.7), Eigen::Vector3d(0.9, 0.1, 0.8));
  EXPECT_EQ(PlacesOf(AttachTo(*graph, cup)), (Indices{0, 1}));
  cup.room = NodeId('R', 2);
  const std::vector<Anchor> anchors = AttachTo(*graph, cup);
  ASSERT_EQ(PlacesOf(anchors), Indices{1});
  EXPECT_NEAR(anchors.front().way_m, std::hypot(1.1, 0.7), 1e-12);
  EXPECT_EQ(anchors.front().node, NodeId('O', 1));
}

TEST(SortAnchors, KeepsTheNearestThingOfEachPlace) {
  std::vector<Anchor> anchors = {
      {3, 1.0, NodeId('O', 1)}, {2, 0.5, {}}, {3, 0.5, NodeId('O', 7)}, {3, 0.5, NodeId('O', 2)}};
  SortAnchors(&anchors);
  EXPECT_EQ(anchors, (std::vector<Anchor>{{2, 0.5, {}}, {3, 0.5, NodeId('O', 2)}}));
}

TEST(PlaceLocator, MissesNoPlaceThatIsNear) {
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 7);
    const auto graph = test::RandomPlaces::Make(&random).Graph();
    const PlaceLocator locator = *PlaceLocator::Build(*graph, {});
    const Eigen::Vector3d corner(random.Uniform(-3.0, 14.0), random.Uniform(-3.0, 14.0),
                                 random.Uniform(-2.0, 5.0));
    const Box3d box(corner, corner + Eigen::Vector3d::Constant(random.Uniform(0.0, 2.0)));
    const double reach_m = random.Chance(0.1) ? 1e9 : random.Uniform(0.0, 4.0);
    std::vector<int> seen(static_cast<size_t>(graph->size()), 0);
    locator.ForEachNear(box, reach_m,
                        [&](PlaceIndex place) { ++seen[static_cast<size_t>(place)]; });
    for (PlaceIndex place = 0; place < graph->size(); ++place) {
      const bool is_near = box.exteriorDistance(graph->position_map(place)) <= reach_m;
      EXPECT_LE(seen[static_cast<size_t>(place)], 1);
      if (is_near) {
        EXPECT_EQ(seen[static_cast<size_t>(place)], 1);
      }
    }
  }
}

}  // namespace
}  // namespace dsg::query
