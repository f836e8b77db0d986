// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/align.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/world/world_graph.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/merge/refine.h"
#include "tests/unit/schema/merge/perceived_half.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::merge {
namespace {

using test::MakeObject;

MapContent ContentOf(std::vector<Node> nodes) {
  MapContent content;
  content.layers = DefaultLayers();
  content.nodes = std::move(nodes);
  content.Index();
  return content;
}

std::vector<Node> Sorted(std::vector<Node> nodes) {
  std::sort(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) { return a.id < b.id; });
  return nodes;
}

MapContent Moved(MapContent content, const Pose3d& transform) {
  for (Node& node : content.nodes) node.map_T_node = transform * node.map_T_node;
  return content;
}

std::vector<Node> ScatteredThings(uint64_t seed, int count) {
  Random random(seed, 8);
  const char* const kClasses[] = {"chair", "table", "lamp", "bed", "plant", "cup"};
  std::vector<Node> nodes;
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(0, 12);
    const double y = random.Uniform(0, 9);
    nodes.push_back(MakeObject(static_cast<uint64_t>(i), kClasses[random.Index(6)],
                               {x, y, random.Uniform(0, 1)}));
  }
  return nodes;
}

TEST(Align, RecoversAnyTurnAndShift) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const MapContent into = ContentOf(ScatteredThings(seed, 25));
    const Pose3d other_T_map = test::SomeTransform(seed);
    const auto found = EstimateTransform(into, Moved(into, other_T_map), {}, {});
    ASSERT_TRUE(found.ok()) << found.status();
    const Pose3d error = found->map_T_other * other_T_map;
    EXPECT_LT(error.position.norm(), 1e-6);
    EXPECT_LT(AngleBetween(error.orientation, Eigen::Quaterniond::Identity()), 1e-6);
    EXPECT_EQ(found->agreeing_count, 25);
  }
}

TEST(Align, WorksFarFromTheOrigin) {
  const MapContent into = ContentOf(ScatteredThings(3, 25));
  Pose3d far = test::SomeTransform(3);
  far.position += Eigen::Vector3d(400'000, -300'000, 100);
  const auto found = EstimateTransform(into, Moved(into, far), {}, {});
  ASSERT_TRUE(found.ok()) << found.status();
  const Eigen::Vector3d middle = into.nodes.front().map_T_node.position;
  EXPECT_LT((found->map_T_other * (far * middle) - middle).norm(), 1e-3);
}

TEST(Align, SaysThatASymmetricalBuildingHasTwoAnswers) {
  // Two wings that are each other's image under half a turn.
  std::vector<Node> nodes = ScatteredThings(4, 15);
  const size_t count = nodes.size();
  for (size_t i = 0; i < count; ++i) {
    Node image = nodes[i];
    image.id = NodeId('O', 100 + i);
    const Eigen::Vector3d& at = nodes[i].map_T_node.position;
    image.map_T_node.position = Eigen::Vector3d(-at.x(), -at.y(), at.z());
    nodes.push_back(std::move(image));
  }
  const MapContent into = ContentOf(nodes);
  const auto found = EstimateTransform(into, Moved(into, test::SomeTransform(4)), {}, {});
  EXPECT_EQ(ReasonOf(found.status()), Reason::kNoRegistration) << found.status();
}

TEST(Align, SaysThatARowOfEqualRoomsHasManyAnswers) {
  std::vector<Node> into;
  std::vector<Node> other;
  for (int room = 0; room < 6; ++room) {
    const double x = 4.0 * room;
    const std::vector<Node> things = {
        MakeObject(static_cast<uint64_t>(room * 3), "desk", {x, 0, 0}),
        MakeObject(static_cast<uint64_t>(room * 3 + 1), "chair", {x, 1, 0}),
        MakeObject(static_cast<uint64_t>(room * 3 + 2), "shelf", {x + 1, 2, 0})};
    if (room < 4) into.insert(into.end(), things.begin(), things.end());
    if (room >= 2) other.insert(other.end(), things.begin(), things.end());
  }
  const auto found = EstimateTransform(ContentOf(into), ContentOf(other), {}, {});
  // Sliding the rows until all rooms meet explains what was seen better than the truth does; that
  // there is no telling is for whoever knows that the rows are longer.
  if (found.ok()) {
    EXPECT_GT(found->agreeing_count, 6);
  } else {
    EXPECT_EQ(ReasonOf(found.status()), Reason::kNoRegistration);
  }
}

TEST(Align, SaysThatStrangersDoNotFit) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const auto found = EstimateTransform(ContentOf(ScatteredThings(seed, 25)),
                                         ContentOf(ScatteredThings(100 + seed, 25)), {}, {});
    EXPECT_EQ(ReasonOf(found.status()), Reason::kNoRegistration) << found.status();
  }
}

TEST(Align, SaysThatBuildingsOfOneStyleAreNotOneBuilding) {
  using simulator::WorldKind;
  struct Strangers {
    WorldKind into;
    uint64_t into_seed;
    WorldKind other;
    uint64_t other_seed;
  };
  // Kitchens and bathrooms are furnished alike, so that ten things and more agree.
  const Strangers kStrangers[] = {{WorldKind::kApartment, 5, WorldKind::kApartment, 1},
                                  {WorldKind::kApartment, 2, WorldKind::kApartment, 1},
                                  {WorldKind::kWing, 1, WorldKind::kApartment, 1},
                                  {WorldKind::kWing, 3, WorldKind::kApartment, 2},
                                  {WorldKind::kOffice, 3, WorldKind::kApartment, 5},
                                  {WorldKind::kWing, 2, WorldKind::kWing, 1}};
  for (const Strangers& pair : kStrangers) {
    SCOPED_TRACE(absl::StrCat("seeds ", pair.into_seed, " and ", pair.other_seed));
    const auto into = simulator::WorldGraph(test::MakeWorld(pair.into, pair.into_seed));
    const auto other = simulator::WorldGraph(test::MakeWorld(pair.other, pair.other_seed));
    const auto found =
        EstimateTransform(ContentOf(Sorted(into.nodes)), ContentOf(Sorted(other.nodes)), {}, {});
    EXPECT_EQ(ReasonOf(found.status()), Reason::kNoRegistration) << found.status();
  }
}

TEST(Align, FindsAnApartmentWhoseHalvesShareAFewThings) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const auto world = test::MakeWorld(simulator::WorldKind::kApartment, seed);
    test::PerceiveOptions west;
    west.to = 0.7;
    west.seed = 1000 + seed;
    test::PerceiveOptions east;
    east.from = 0.3;
    east.seed = 2000 + seed;
    east.map_T_world = test::SomeTransform(seed);
    const auto found =
        EstimateTransform(ContentOf(Sorted(test::Perceive(world, west).delta.nodes)),
                          ContentOf(Sorted(test::Perceive(world, east).delta.nodes)), {}, {});
    ASSERT_TRUE(found.ok()) << found.status();
    const Pose3d error = found->map_T_other * east.map_T_world;
    const Eigen::Vector3d middle(6, 5, 1);
    EXPECT_LT((error * middle - middle).norm(), 0.15);
  }
}

TEST(Align, TellsWhatSpeaksForATransformAndWhatAgainst) {
  const auto graph = simulator::WorldGraph(test::MakeWorld(simulator::WorldKind::kWing, 1));
  const MapContent wing = ContentOf(Sorted(graph.nodes));
  const Evidence right = EvidenceFor(wing, wing, Pose3d(), {});
  EXPECT_GT(right.agreeing_count, 150);
  EXPECT_EQ(right.missing_count, 0);
  EXPECT_LT(right.blocked_share, 0.01);
  const Pose3d beside{{5, 5, 0}, Eigen::Quaterniond::Identity()};
  const Evidence wrong = EvidenceFor(wing, wing, beside, {});
  EXPECT_LT(wrong.agreeing_count, 20);
  EXPECT_GT(wrong.missing_count, 100);
  EXPECT_GT(wrong.blocked_share, 0.1);
}

TEST(Align, SaysThatTooFewThingsAgree) {
  const auto none = EstimateTransform(ContentOf({}), ContentOf({}), {}, {});
  EXPECT_EQ(ReasonOf(none.status()), Reason::kNoRegistration);
  const auto few =
      EstimateTransform(ContentOf(ScatteredThings(1, 3)), ContentOf(ScatteredThings(1, 3)), {}, {});
  EXPECT_EQ(ReasonOf(few.status()), Reason::kNoRegistration);
}

TEST(Refine, MendsDecimetresOnPointsAndPlanes) {
  Random random(5, 1);
  const Pose3d truth = test::SomeTransform(5);
  std::vector<Sighting> sightings;
  for (int i = 0; i < 200; ++i) {
    Sighting sighting;
    sighting.other =
        Eigen::Vector3d(random.Uniform(0, 20), random.Uniform(0, 20), random.Uniform(0, 3));
    sighting.into = truth * sighting.other;
    if (i % 2 == 0) {
      sighting.normal_into = Eigen::Vector3d(i % 4 == 0 ? 1 : 0, i % 4 == 0 ? 0 : 1, 0);
    }
    // Every tenth is nonsense.
    if (i % 10 == 0) sighting.into += Eigen::Vector3d(3, -2, 1);
    sighting.sigma_m = 0.05;
    sightings.push_back(sighting);
  }
  Pose3d start = truth;
  start.position += Eigen::Vector3d(0.2, -0.1, 0.1);
  start.orientation = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()) * start.orientation;
  const Pose3d found = FitSightings(sightings, start);
  EXPECT_LT((found * Eigen::Vector3d(10, 10, 1) - truth * Eigen::Vector3d(10, 10, 1)).norm(), 0.01);
  EXPECT_LT(AngleBetween(found.orientation, truth.orientation), 0.001);
}

}  // namespace
}  // namespace dsg::merge
