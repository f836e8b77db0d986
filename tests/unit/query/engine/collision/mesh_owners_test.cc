// SPDX-License-Identifier: Apache-2.0
// Whose triangles are whose, and what counts in place of a box.
#include "query/engine/collision/collision_cache.h"

#include <gtest/gtest.h>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using test::Ask;
using test::Scene;
using test::SphereAt;

constexpr uint32_t kTable = 41;

// A table whose box is full of air: a plate on one leg.
std::vector<Convex> TableTriangles() {
  std::vector<Convex> triangles = test::Rectangle({-0.5, -0.5, 0.75}, {1, 0, 0}, {0, 1, 0});
  for (const Convex& leg : test::Rectangle({0, 0, 0}, {0.05, 0, 0}, {0, 0, 0.75})) {
    triangles.push_back(leg);
  }
  return triangles;
}

Node Table(uint32_t instance) {
  const Vector3d half(0.5, 0.5, 0.375);
  Node table =
      test::ObjectAt(1, {{0, 0, 0.375}, Eigen::Quaterniond::Identity()}, Box3d(-half, half));
  table.object->mesh_instance_id = instance;
  return table;
}

TEST(MeshOwners, AnObjectIsItsTrianglesWhereTheMeshHasThem) {
  Scene scene;
  GraphDelta delta;
  delta.nodes = {Table(kTable)};
  delta.mesh_blocks = test::Blocks(TableTriangles(), {kTable, kTable, kTable, kTable});
  const Revision revision = scene.Commit(delta);
  const Body under_the_plate = SphereAt(0.1, {0.3, 0.3, 0.4});
  for (const bool mesh : {true, false}) {
    CollisionScope scope;
    scope.mesh = mesh;
    const CollisionHit hit = Ask(scene.World(revision), under_the_plate, scope);
    EXPECT_FALSE(hit.hit);
    EXPECT_NEAR(hit.clearance_m, 0.25, 1e-6);
    EXPECT_EQ(hit.node, NodeId('O', 1));
    EXPECT_EQ(hit.kind, ObstacleKind::kObject);
  }
}

TEST(MeshOwners, AnObjectIsItsBoxWhereTheMeshKnowsItNot) {
  Scene scene;
  GraphDelta delta;
  delta.nodes = {Table(kTable + 1)};
  delta.mesh_blocks = test::Blocks(TableTriangles(), {kTable, kTable, kTable, kTable});
  const Revision revision = scene.Commit(delta);
  EXPECT_TRUE(Ask(scene.World(revision), SphereAt(0.1, {0.3, 0.3, 0.4}), {}).hit);
}

TEST(MeshOwners, TrianglesOfAnObjectThatLeftOrIsIgnoredAreNotThere) {
  Scene scene;
  GraphDelta delta;
  Node table = Table(kTable);
  table.valid = {100, 200};
  delta.nodes = {table};
  delta.mesh_blocks = test::Blocks(TableTriangles(), {kTable, kTable, kTable, kTable});
  const Revision revision = scene.Commit(delta);
  const Body on_the_plate = SphereAt(0.1, {0.3, 0.3, 0.8});
  EXPECT_TRUE(Ask(scene.World(revision, 150), on_the_plate, {}).hit);
  EXPECT_FALSE(Ask(scene.World(revision, 250), on_the_plate, {}).hit);
  EXPECT_FALSE(Ask(scene.World(revision), on_the_plate, {}).hit);
  CollisionWorld world = scene.World(revision, 150);
  CollisionScope scope;
  ASSERT_TRUE(world.Ignore(NodeId('O', 1), {}, &scope).ok());
  EXPECT_FALSE(Ask(std::move(world), on_the_plate, scope).hit);
}

TEST(MeshOwners, AWallWithADoorIsPassableWhereTheMeshShowsTheDoor) {
  const Box3d wall(Vector3d(1, -2, 0), Vector3d(1.1, 2, 2.5));
  const Body through = SweptSphere(0.3, {{0, 0, 1}, {2, 0, 1}});
  {
    Scene scene;
    GraphDelta delta;
    delta.nodes = {test::StructureAt(1, "wall", wall, Vector3d::UnitX())};
    const Revision revision = scene.Commit(delta);
    EXPECT_TRUE(Ask(scene.World(revision), through, {}).hit);
  }
  Scene scene;
  GraphDelta delta;
  delta.nodes = {test::StructureAt(1, "wall", wall, Vector3d::UnitX())};
  std::vector<Convex> beside = test::Rectangle({1.05, -2, 0}, {0, 1.5, 0}, {0, 0, 2.5});
  for (const Convex& part : test::Rectangle({1.05, 0.5, 0}, {0, 1.5, 0}, {0, 0, 2.5})) {
    beside.push_back(part);
  }
  delta.mesh_blocks = test::Blocks(beside, {});
  const Revision revision = scene.Commit(delta);
  CollisionHit hit = Ask(scene.World(revision), through, {});
  EXPECT_FALSE(hit.hit);
  EXPECT_NEAR(hit.clearance_m, 0.2, 1e-6);
  EXPECT_EQ(hit.node, NodeId('S', 1));
  CollisionScope structures_only;
  structures_only.mesh = structures_only.objects = structures_only.agents = false;
  hit = Ask(scene.World(revision), SweptSphere(0.3, {{0, 1, 1}, {2, 1, 1}}), structures_only);
  EXPECT_TRUE(hit.hit);
  EXPECT_EQ(hit.kind, ObstacleKind::kStructure);
}

TEST(MeshOwners, AWallAcrossItsBoxCountsByItsPlane) {
  Scene scene;
  GraphDelta delta;
  delta.nodes = {test::StructureAt(1, "wall", Box3d(Vector3d(0, 0, 0), Vector3d(4, 4, 2)),
                                   Vector3d(1, -1, 0).normalized())};
  const Revision revision = scene.Commit(delta);
  EXPECT_TRUE(Ask(scene.World(revision), SphereAt(0.1, {1, 1.05, 1}), {}).hit);
  const CollisionHit hit = Ask(scene.World(revision), SphereAt(0.1, {3, 1, 1}), {});
  EXPECT_FALSE(hit.hit);
  EXPECT_NEAR(hit.clearance_m, std::sqrt(2.0) - 0.1, 1e-9);
}

TEST(MeshOwners, WheelsMayTouchTheFloorButNotWhatStandsOnIt) {
  Scene scene;
  GraphDelta delta;
  delta.nodes = {test::StructureAt(1, "floor", Box3d(Vector3d(-3, -3, -0.05), Vector3d(3, 3, 0.05)),
                                   Vector3d::UnitZ())};
  std::vector<Convex> triangles;
  for (int x = -3; x < 3; ++x) {
    for (int y = -3; y < 3; ++y) {
      for (const Convex& tile : test::Rectangle({1.0 * x, 1.0 * y, 0.02}, {1, 0, 0}, {0, 1, 0})) {
        triangles.push_back(tile);
      }
    }
  }
  // A skirting board, lower than the tolerance of the floor's plane.
  for (const Convex& board : test::Rectangle({1.5, -3, 0}, {0, 6, 0}, {0, 0, 0.08})) {
    triangles.push_back(board);
  }
  delta.mesh_blocks = test::Blocks(triangles, {});
  const Revision revision = scene.Commit(delta);
  const Body wheel = SweptSphere(0.1, {{0, 0, 0.09}, {1, 0, 0.09}});
  CollisionScope scope;
  EXPECT_TRUE(Ask(scene.World(revision), wheel, scope).hit);
  scope.ignore_floor = true;
  CollisionHit hit = Ask(scene.World(revision), wheel, scope);
  EXPECT_FALSE(hit.hit);
  EXPECT_NEAR(hit.clearance_m, 0.4, 1e-3);
  hit = Ask(scene.World(revision), SweptSphere(0.1, {{0, 0, 0.09}, {2, 0, 0.09}}), scope);
  EXPECT_TRUE(hit.hit);
  EXPECT_NEAR(hit.at_pose, 1.4 / 2.0, 0.01);
  CollisionScope structures_only = scope;
  structures_only.mesh = structures_only.objects = structures_only.agents = false;
  EXPECT_EQ(Ask(scene.World(revision), wheel, structures_only).kind, ObstacleKind::kNone);
}

}  // namespace
}  // namespace dsg::query
