// SPDX-License-Identifier: Apache-2.0
// A body is observed only where the map knows something around all of it.
#include "query/engine/collision/observation.h"

#include <gtest/gtest.h>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using test::Ask;
using test::Scene;

Node PlaceAt(uint64_t index, const Vector3d& position, double clearance_m) {
  Node place;
  place.id = NodeId('p', index);
  place.layer = layers::kPlaces;
  place.kind = kinds::kPlace;
  place.map_T_node.position = position;
  place.place.emplace();
  place.place->clearance_m = clearance_m;
  return place;
}

Body CuboidAt(const Vector3d& size, const Vector3d& position, double yaw = 0.0) {
  Body body;
  body.kind = Body::Kind::kCuboid;
  body.size = size;
  body.poses = {{position, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()))}};
  return body;
}

TEST(Observation, PointsReachAllOverTheBody) {
  Body body = CuboidAt({3.5, 0.2, 20}, {0, 0, 0});
  std::vector<Vector3d> points = ObservedPoints(body);
  EXPECT_EQ(points.size(), 1u + 5 * 2 * 8);
  Box3d reached;
  for (const Vector3d& point : points) reached.extend(point);
  EXPECT_LT((reached.sizes() - body.size).norm(), 1e-9);
  EXPECT_EQ(points.front(), Vector3d(0, 0, 0));
  body.kind = Body::Kind::kSphere;
  body.radius_m = 2.0;
  for (const Vector3d& point : ObservedPoints(body)) EXPECT_LE(point.norm(), 2.0);
  body.kind = Body::Kind::kCapsule;
  body.radius_m = 0.25;
  body.length_m = 0.5;
  reached.setEmpty();
  for (const Vector3d& point : ObservedPoints(body)) reached.extend(point);
  EXPECT_LT((reached.sizes() - Vector3d(0.5, 0.5, 1.0)).norm(), 1e-9);
  body.kind = Body::Kind::kMesh;
  body.mesh = std::make_shared<const TriangleTree>(
      std::vector<Eigen::Vector3f>{{5, 0, 0}, {6, 0, 0}, {5, 1, 0}},
      std::vector<std::array<uint32_t, 3>>{{0, 1, 2}});
  EXPECT_EQ(ObservedPoints(body).front(), Vector3d(5.5, 0.5, 0));
}

TEST(Observation, ALongBodyWhoseEndsAreOutsideIsNotObserved) {
  Scene scene;
  GraphDelta delta;
  delta.nodes = {PlaceAt(1, {0, 0, 0}, 1.5)};
  const Revision revision = scene.Commit(delta);
  const auto observed = [&](const Body& body) {
    return Ask(scene.World(revision), body, {}).observed;
  };
  EXPECT_TRUE(observed(CuboidAt({0.4, 0.4, 0.4}, {0, 0, 0})));
  EXPECT_TRUE(observed(CuboidAt({2.8, 0.1, 0.1}, {0, 0, 0})));
  EXPECT_FALSE(observed(CuboidAt({3.2, 0.1, 0.1}, {0, 0, 0})));
  // The same beam across: its ends are what matters.
  EXPECT_TRUE(observed(CuboidAt({2.0, 0.1, 0.1}, {0, 1.0, 0})));
  EXPECT_FALSE(observed(CuboidAt({2.0, 0.1, 0.1}, {0, 1.0, 0}, 1.5708)));
  EXPECT_TRUE(observed(test::SphereAt(1.4, {0, 0, 0})));
  EXPECT_FALSE(observed(test::SphereAt(1.6, {0, 0, 0})));
}

TEST(Observation, AHitAtOneEndDoesNotProveTheOther) {
  Scene scene;
  GraphDelta delta;
  const Box3d cube(Vector3d(-.5, -.5, -.5), Vector3d(.5, .5, .5));
  delta.nodes = {test::ObjectAt(1, {{0, 0, 0}, Eigen::Quaterniond::Identity()}, cube)};
  const Revision revision = scene.Commit(delta);
  const CollisionHit small = Ask(scene.World(revision), CuboidAt({0.5, 0.5, 0.5}, {1, 0, 0}), {});
  EXPECT_TRUE(small.observed);
  const CollisionHit large = Ask(scene.World(revision), CuboidAt({6, 0.5, 0.5}, {3, 0, 0}), {});
  EXPECT_TRUE(large.hit);
  EXPECT_FALSE(large.observed);
}

TEST(Observation, NothingBetweenTheCornersIsForgotten) {
  Scene scene;
  GraphDelta delta;
  for (uint64_t i = 0; i < 8; ++i) {
    const Vector3d corner((i & 1) != 0 ? 3 : -3, (i & 2) != 0 ? 3 : -3, (i & 4) != 0 ? 3 : -3);
    delta.nodes.push_back(PlaceAt(i + 1, corner, 1.0));
  }
  delta.nodes.push_back(PlaceAt(9, {0, 0, 0}, 1.0));
  const Revision revision = scene.Commit(delta);
  EXPECT_FALSE(Ask(scene.World(revision), CuboidAt({6, 6, 6}, {0, 0, 0}), {}).observed);
}

TEST(Observation, ATurningBodySweepsWhereNobodyLooked) {
  Scene scene;
  GraphDelta delta;
  for (int x = -2; x <= 2; ++x) {
    delta.nodes.push_back(PlaceAt(static_cast<uint64_t>(x + 3), {1.0 * x, 0, 0}, 0.8));
  }
  const Revision revision = scene.Commit(delta);
  Body beam = CuboidAt({4, 0.1, 0.1}, {0, 0, 0});
  EXPECT_TRUE(Ask(scene.World(revision), beam, {}).observed);
  // Half a turn ends where it began.
  beam.poses.push_back(CuboidAt({4, 0.1, 0.1}, {0, 0, 0}, 3.1).poses[0]);
  EXPECT_FALSE(Ask(scene.World(revision), beam, {}).observed);
}

TEST(Observation, ALargeTriangleIsKnownFarFromItsBlock) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks({MakeTriangle({0, 0, 0}, {50, 0, 0}, {0, 50, 0})}, {});
  const Revision revision = scene.Commit(delta);
  CollisionScope none;
  none.objects = none.structures = none.mesh = false;
  for (const bool with_mesh : {true, false}) {
    none.mesh = with_mesh;
    const auto observed = [&](double z) {
      return Ask(scene.World(revision), test::SphereAt(0.2, {15, 15, z}), none).observed;
    };
    EXPECT_TRUE(observed(0.5));
    EXPECT_TRUE(observed(0.79));
    EXPECT_FALSE(observed(0.85));
  }
}

TEST(Observation, DoesNotDependOnWhatTheBodyMayRunInto) {
  Random random(test::TestSeed(14), 0);
  Scene scene;
  GraphDelta delta;
  std::vector<Convex> triangles;
  for (uint64_t i = 1; i <= 20; ++i) {
    delta.nodes.push_back(
        test::ObjectAt(i, test::RandomPose(&random, 5.0), test::RandomBox(&random)));
    delta.nodes.push_back(PlaceAt(i, test::RandomPose(&random, 5.0).position, 0.9));
    const Pose3d pose = test::RandomPose(&random, 5.0);
    triangles.push_back(MakeTriangle(pose * Vector3d(0, 0, 0), pose * Vector3d(5, 0, 0),
                                     pose * Vector3d(0, 0.4, 0)));
  }
  delta.mesh_blocks = test::Blocks(triangles, {});
  const Revision revision = scene.Commit(delta);
  int observed_count = 0;
  for (int i = 0; i < 400; ++i) {
    Body body = CuboidAt(test::RandomBox(&random).sizes(), {0, 0, 0});
    if (i % 2 == 0) body = test::SphereAt(random.Uniform(0.05, 0.6), {0, 0, 0});
    body.poses = {test::RandomPose(&random, 5.0)};
    CollisionScope nothing;
    nothing.objects = nothing.structures = nothing.mesh = nothing.agents = false;
    const bool observed = Ask(scene.World(revision), body, nothing).observed;
    EXPECT_EQ(Ask(scene.World(revision), body, {}).observed, observed) << i;
    observed_count += observed ? 1 : 0;
  }
  EXPECT_GT(observed_count, 40);
  EXPECT_LT(observed_count, 360);
}

}  // namespace
}  // namespace dsg::query
