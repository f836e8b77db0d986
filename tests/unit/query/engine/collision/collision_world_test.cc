// SPDX-License-Identifier: Apache-2.0
// What a body touches in a map: the same as looking at every box and triangle, at any revision and
// instant.
#include "query/engine/collision/collision_world.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using test::Ask;
using test::Scene;
using test::SphereAt;

struct Thing {
  NodeId node;
  Convex shape;
};

// Objects and loose triangles around the origin.
struct RandomThings {
  GraphDelta delta;
  std::vector<Thing> things;

  explicit RandomThings(Random* random) {
    for (uint64_t i = 1; i <= 60; ++i) {
      const Pose3d pose = test::RandomPose(random, 4.0);
      const Box3d box = test::RandomBox(random);
      delta.nodes.push_back(test::ObjectAt(i, pose, box));
      things.push_back({NodeId('O', i), MakeBox(pose, box)});
    }
    std::vector<Convex> triangles;
    for (int i = 0; i < 400; ++i) {
      const Pose3d pose = test::RandomPose(random, 4.0);
      const auto corner = [&](double x, double y) {
        return Vector3d((pose * Vector3d(x, y, 0)).cast<float>().cast<double>());
      };
      triangles.push_back(MakeTriangle(corner(0, 0), corner(0.4, 0.1), corner(0.1, 0.3)));
      things.push_back({NodeId(), triangles.back()});
    }
    delta.mesh_blocks = test::Blocks(triangles, {});
  }
};

Body RandomBody(Random* random) {
  Body body;
  body.poses = {test::RandomPose(random, 4.0)};
  switch (random->Index(4)) {
    case 0:
      body.kind = Body::Kind::kSphere;
      body.radius_m = random->Uniform(0.01, 0.4);
      break;
    case 1:
      body.kind = Body::Kind::kCuboid;
      body.size = test::RandomBox(random).sizes();
      break;
    case 2:
      body.kind = Body::Kind::kCapsule;
      body.radius_m = random->Uniform(0.01, 0.3);
      body.length_m = random->Chance(0.1) ? 0.0 : random->Uniform(0.1, 1.5);
      break;
    default: {
      body.kind = Body::Kind::kMesh;
      std::vector<Eigen::Vector3f> vertices;
      std::vector<std::array<uint32_t, 3>> faces;
      for (uint32_t i = 0; i < 30; ++i) {
        vertices.push_back(test::RandomPose(random, 0.4).position.cast<float>());
        if (i >= 2) faces.push_back({i - 2, i - 1, i});
      }
      body.mesh = std::make_shared<const TriangleTree>(vertices, faces);
    }
  }
  return body;
}

// Of the body at its first pose, looking at everything.
double SlowClearance(const Body& body, const std::vector<Thing>& things) {
  const Pose3d& pose = body.poses.front();
  std::vector<Convex> parts;
  if (body.kind == Body::Kind::kSphere) parts.push_back(MakePoint(pose.position));
  if (body.kind == Body::Kind::kCuboid) {
    parts.push_back(MakeBox(pose, Box3d(-0.5 * body.size, 0.5 * body.size)));
  }
  const Vector3d half(0, 0, 0.5 * body.length_m);
  if (body.kind == Body::Kind::kCapsule) parts.push_back(MakeSegment(pose * -half, pose * half));
  for (int i = 0; body.mesh != nullptr && i < body.mesh->face_count(); ++i) {
    parts.push_back(body.mesh->Triangle(i, pose));
  }
  double clearance_m = std::numeric_limits<double>::infinity();
  for (const Convex& part : parts) {
    for (const Thing& thing : things) {
      clearance_m = std::min(clearance_m, Distance(part, thing.shape).distance_m);
    }
  }
  return std::max(0.0, clearance_m - body.radius_m);
}

TEST(CollisionWorld, AnswersAsLookingAtEverythingDoes) {
  Random random(test::TestSeed(6), 0);
  Scene scene;
  const RandomThings things(&random);
  const Revision revision = scene.Commit(things.delta);
  int hit_count = 0;
  for (int i = 0; i < 600; ++i) {
    SCOPED_TRACE(i);
    const Body body = RandomBody(&random);
    CollisionScope scope;
    scope.clearance_m_max = random.Chance(0.5) ? 2.0 : random.Uniform(0.1, 0.6);
    scope.margin_m = random.Chance(0.5) ? 0.0 : 0.05;
    const CollisionHit hit = Ask(scene.World(revision), body, scope);
    const double clearance_m = SlowClearance(body, things.things);
    EXPECT_NEAR(hit.clearance_m, std::min(clearance_m, scope.clearance_m_max), 1e-6);
    EXPECT_EQ(hit.hit, clearance_m <= scope.margin_m);
    hit_count += hit.hit ? 1 : 0;
    if (hit.kind == ObstacleKind::kNone) {
      EXPECT_GE(clearance_m, scope.clearance_m_max);
      continue;
    }
    // The point is on the thing that is named.
    double to_thing_m = std::numeric_limits<double>::infinity();
    for (const Thing& thing : things.things) {
      if (thing.node != hit.node) continue;
      const double off_m = (NearestPoint(thing.shape, hit.point_map) - hit.point_map).norm();
      to_thing_m = std::min(to_thing_m, off_m);
    }
    EXPECT_LT(to_thing_m, 1e-6);
    EXPECT_EQ(hit.kind, hit.node.empty() ? ObstacleKind::kMesh : ObstacleKind::kObject);
  }
  EXPECT_GT(hit_count, 100);
  EXPECT_LT(hit_count, 500);
}

TEST(CollisionWorld, NamesTheLowestIdOfThoseThatAreEquallyNear) {
  Scene scene;
  GraphDelta delta;
  const Box3d cube(Vector3d(-.5, -.5, -.5), Vector3d(.5, .5, .5));
  for (const uint64_t id : {7, 3, 5}) {
    delta.nodes.push_back(test::ObjectAt(id, {{1, 0, 0}, Eigen::Quaterniond::Identity()}, cube));
  }
  const Revision revision = scene.Commit(delta);
  EXPECT_EQ(Ask(scene.World(revision), SphereAt(0.1, {0, 0, 0}), {}).node, NodeId('O', 3));
  EXPECT_EQ(Ask(scene.World(revision), SphereAt(0.1, {1, 0, 0}), {}).node, NodeId('O', 3));
  const Body moving = SweptSphere(0.1, {{-1, 0, 0}, {2, 0, 0}});
  const CollisionHit hit = Ask(scene.World(revision), moving, {});
  EXPECT_EQ(hit.node, NodeId('O', 3));
  EXPECT_NEAR(hit.at_pose, 1.4 / 3.0, 1e-9);
}

TEST(CollisionWorld, HonoursRevisionAndInstant) {
  Scene scene;
  GraphDelta first;
  const Box3d cube(Vector3d(-.5, -.5, -.5), Vector3d(.5, .5, .5));
  Node chair = test::ObjectAt(1, {{1, 0, 0}, Eigen::Quaterniond::Identity()}, cube);
  chair.valid = {10, 20};
  first.nodes = {chair};
  first.mesh_blocks = test::Blocks(test::Rectangle({5, 0, 0}, {0, 1, 0}, {0, 0, 1}), {});
  const Revision before = scene.Commit(first);
  GraphDelta second;
  chair.map_T_node.position.x() = 3.0;
  chair.valid = {10, kTimeMax};
  second.nodes = {chair};
  second.mesh_blocks = test::Blocks(test::Rectangle({4.5, 0, 0}, {0, 1, 0}, {0, 0, 1}), {});
  const Revision after = scene.Commit(second);

  const Body at_1 = SphereAt(0.1, {1, 0, 0});
  EXPECT_TRUE(Ask(scene.World(before, 15), at_1, {}).hit);
  EXPECT_FALSE(Ask(scene.World(before, 20), at_1, {}).hit);
  EXPECT_FALSE(Ask(scene.World(before, 9), at_1, {}).hit);
  EXPECT_FALSE(Ask(scene.World(before), at_1, {}).hit);
  EXPECT_FALSE(Ask(scene.World(after, 15), at_1, {}).hit);
  EXPECT_TRUE(Ask(scene.World(after), SphereAt(0.1, {3, 0, 0}), {}).hit);
  EXPECT_TRUE(Ask(scene.World(before), SphereAt(0.1, {5, 0.5, 0.5}), {}).hit);
  EXPECT_FALSE(Ask(scene.World(after), SphereAt(0.1, {5, 0.5, 0.5}), {}).hit);
  EXPECT_TRUE(Ask(scene.World(after), SphereAt(0.1, {4.5, 0.5, 0.5}), {}).hit);
}

TEST(CollisionWorld, LeavesOutWhatIsNotAskedFor) {
  Scene scene;
  GraphDelta delta;
  const Box3d cube(Vector3d(-.5, -.5, -.5), Vector3d(.5, .5, .5));
  delta.nodes = {test::ObjectAt(1, {{0, 0, 0}, Eigen::Quaterniond::Identity()}, cube),
                 test::StructureAt(1, "wall", Box3d(Vector3d(1, -1, -1), Vector3d(1.1, 1, 1)),
                                   Vector3d::UnitX())};
  delta.mesh_blocks = test::Blocks(test::Rectangle({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}), {});
  const Revision revision = scene.Commit(delta);
  const Body body = SphereAt(0.1, {0, 0, 0.1});
  CollisionScope scope;
  scope.objects = scope.structures = scope.agents = false;
  CollisionHit hit = Ask(scene.World(revision), body, scope);
  EXPECT_EQ(hit.kind, ObstacleKind::kMesh);
  EXPECT_NEAR(hit.clearance_m, 0.9, 1e-6);
  scope.mesh = false;
  scope.structures = true;
  hit = Ask(scene.World(revision), body, scope);
  EXPECT_EQ(hit.node, NodeId('S', 1));
  EXPECT_NEAR(hit.clearance_m, 0.9, 1e-6);
  scope.objects = true;
  EXPECT_TRUE(Ask(scene.World(revision), body, scope).hit);
  CollisionWorld world = scene.World(revision);
  ASSERT_TRUE(world.Ignore(NodeId('O', 1), {}, &scope).ok());
  EXPECT_FALSE(Ask(std::move(world), body, scope).hit);
}

TEST(CollisionWorld, SaysWhereNobodyHasLooked) {
  Scene scene;
  GraphDelta delta;
  Node place;
  place.id = NodeId('p', 1);
  place.layer = layers::kPlaces;
  place.kind = kinds::kPlace;
  place.map_T_node.position = {20, 0, 0};
  place.place.emplace();
  place.place->clearance_m = 1.5;
  const Box3d cube(Vector3d(-.5, -.5, -.5), Vector3d(.5, .5, .5));
  delta.nodes = {place, test::ObjectAt(1, {{0, 0, 0}, Eigen::Quaterniond::Identity()}, cube)};
  delta.mesh_blocks = test::Blocks(test::Rectangle({-9, 0, 0}, {0, 1, 0}, {0, 0, 1}), {});
  const Revision revision = scene.Commit(delta);
  const auto observed = [&](const std::vector<Vector3d>& way) {
    return Ask(scene.World(revision), SweptSphere(0.1, way), {}).observed;
  };
  EXPECT_TRUE(observed({{1, 0, 0}}));
  EXPECT_TRUE(observed({{20, 1.2, 0}}));
  EXPECT_TRUE(observed({{-9.5, 1.5, 1.5}}));
  EXPECT_FALSE(observed({{20, 1.6, 0}}));
  EXPECT_FALSE(observed({{10, 0, 0}}));
  EXPECT_TRUE(observed({{19, 0, 0}, {21, 0, 0}}));
  EXPECT_FALSE(observed({{19, 0, 0}, {22, 0, 0}}));
  EXPECT_FALSE(observed({{1000, 0, 0}}));
}

TEST(CollisionWorld, StopsWhenItIsTold) {
  Random random(test::TestSeed(7), 0);
  Scene scene;
  const Revision revision = scene.Commit(RandomThings(&random).delta);
  int asked_count = 0;
  const StopCheck stop = [&] {
    return ++asked_count < 5 ? absl::OkStatus() : absl::CancelledError("enough");
  };
  CollisionWorld world = scene.World(revision);
  const auto hit = world.Check(SweptSphere(0.01, {{-90, 9, 0}, {90, 9, 0}}), {}, stop);
  EXPECT_EQ(hit.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(asked_count, 5);
}

// A wavy sheet of 10,000 faces, 2 m wide.
std::vector<Convex> Sheet() {
  const auto at = [](int x, int y) {
    const float z = 0.05f * std::sin(0.9f * static_cast<float>(x + 2 * y));
    return Eigen::Vector3f(0.02f + 0.027f * static_cast<float>(x),
                           0.02f + 0.027f * static_cast<float>(y), z);
  };
  std::vector<Convex> triangles;
  const auto add = [&](const auto& a, const auto& b, const auto& c) {
    triangles.push_back(MakeTriangle(a.template cast<double>(), b.template cast<double>(),
                                     c.template cast<double>()));
  };
  for (int x = 0; x < 70; ++x) {
    for (int y = 0; y < 71; ++y) {
      add(at(x, y), at(x + 1, y), at(x, y + 1));
      add(at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
    }
  }
  return triangles;
}

// Nearly as far from all of the mesh, so that very many pairs are nearly the nearest.
Body SheetAbove(double height_m) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
  for (const Convex& triangle : Sheet()) {
    const auto first = static_cast<uint32_t>(vertices.size());
    for (size_t i = 0; i < 3; ++i) vertices.push_back(triangle.corners[i].cast<float>());
    faces.push_back({first, first + 1, first + 2});
  }
  Body body;
  body.kind = Body::Kind::kMesh;
  body.mesh = std::make_shared<const TriangleTree>(vertices, faces);
  body.poses = {{{0, 0, height_m}, Eigen::Quaterniond::Identity()}};
  return body;
}

TEST(CollisionWorld, StopsWithinOneLookOfALargeMeshAtAnother) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks(Sheet(), {});
  const Revision revision = scene.Commit(delta);
  const Body body = SheetAbove(0.3);
  int asked_count = 0;
  const StopCheck count = [&] {
    ++asked_count;
    return absl::OkStatus();
  };
  CollisionWorld world = scene.World(revision);
  ASSERT_TRUE(world.Check(body, {}, count).ok());
  const int before_count = asked_count;
  asked_count = 0;
  ASSERT_TRUE(world.Check(body, {}, count).ok());
  // Asked at every 256th pair of boxes or triangles, not only at each of a handful of steps.
  EXPECT_GT(asked_count, 80);
  EXPECT_LE(asked_count, before_count);
  for (const int last : {1, 7, asked_count / 2, asked_count - 1}) {
    int told_count = 0;
    const StopCheck stop = [&] {
      return ++told_count < last ? absl::OkStatus() : absl::CancelledError("enough");
    };
    const auto hit = world.Check(body, {}, stop);
    EXPECT_EQ(hit.status().code(), absl::StatusCode::kCancelled);
    // Once told, it does not ask again.
    EXPECT_EQ(told_count, last);
  }
}

TEST(CollisionWorld, StopsAmongTheTrianglesThatABodyTouches) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks(Sheet(), {});
  const Revision revision = scene.Commit(delta);
  Body box;
  box.kind = Body::Kind::kCuboid;
  box.size = {4, 4, 1};
  box.poses = {{{1, 1, 0}, Eigen::Quaterniond::Identity()}};
  const Body sphere = SweptSphere(3.0, {{1, 1, 3.3}, {1, 1, 2.8}});
  for (const Body& body : {box, sphere}) {
    int asked_count = 0;
    const StopCheck count = [&] {
      ++asked_count;
      return absl::OkStatus();
    };
    CollisionWorld world = scene.World(revision);
    ASSERT_TRUE(world.Check(body, {}, count).ok());
    asked_count = 0;
    ASSERT_TRUE(world.Check(body, {}, count)->hit);
    EXPECT_GT(asked_count, 20);
    for (const int last : {1, 2, asked_count / 2, asked_count}) {
      int told_count = 0;
      const StopCheck stop = [&] {
        return ++told_count < last ? absl::OkStatus() : absl::CancelledError("enough");
      };
      EXPECT_EQ(world.Check(body, {}, stop).status().code(), absl::StatusCode::kCancelled);
      EXPECT_EQ(told_count, last);
    }
  }
}

}  // namespace
}  // namespace dsg::query
