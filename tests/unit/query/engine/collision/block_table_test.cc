// SPDX-License-Identifier: Apache-2.0
// Faces of any length are found, however far they reach out of their blocks.
#include "query/engine/collision/collision_cache.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using test::Ask;
using test::Scene;
using test::SphereAt;

// Short ones and such as reach over dozens of blocks.
std::vector<Convex> TrianglesOfAllLengths(Random* random, int count) {
  std::vector<Convex> triangles;
  for (int i = 0; i < count; ++i) {
    const double length_m = std::exp(random->Uniform(std::log(0.05), std::log(80.0)));
    const Pose3d pose = test::RandomPose(random, 20.0);
    const auto corner = [&](double x, double y) {
      return Vector3d((pose * (length_m * Vector3d(x, y, 0))).cast<float>().cast<double>());
    };
    triangles.push_back(MakeTriangle(corner(0, 0), corner(1, 0.02), corner(0.4, 0.05)));
  }
  return triangles;
}

double SlowSphereClearance(const Vector3d& center, double radius_m,
                           const std::vector<Convex>& triangles) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Convex& triangle : triangles) {
    nearest_m = std::min(nearest_m, (NearestPoint(triangle, center) - center).norm());
  }
  return std::max(0.0, nearest_m - radius_m);
}

CollisionHit Clearance(CollisionWorld world, const Vector3d& center) {
  return Ask(std::move(world), SphereAt(0.3, center), {});
}

TEST(BlockTable, FindsBlocksByTheirTrianglesNotByTheirCubes) {
  BlockBounds near{{0, 0, 0}, 1, {}};
  near.bounds.extend(Eigen::Vector3f(0, 0, 0)).extend(Eigen::Vector3f(50, 1, 1));
  BlockBounds far{{9, 0, 0}, 1, {}};
  far.bounds.extend(Eigen::Vector3f(18, 0, 0)).extend(Eigen::Vector3f(19, 1, 1));
  const BlockBounds empty{{20, 0, 0}, 1, {}};
  const BlockTable table({near, far, empty});
  const auto touching = [&](double x) {
    std::vector<int32_t> found;
    for (const BlockBounds* block : table.Touching(Box3d(Vector3d(x, 0.5, 0.5)))) {
      found.push_back(block->block.x);
    }
    return found;
  };
  EXPECT_EQ(touching(10), (std::vector<int32_t>{0}));
  EXPECT_EQ(touching(18.5), (std::vector<int32_t>{0, 9}));
  EXPECT_EQ(touching(50), (std::vector<int32_t>{0}));
  EXPECT_EQ(touching(50.1), (std::vector<int32_t>{}));
  EXPECT_EQ(touching(40.5), (std::vector<int32_t>{0}));
  EXPECT_TRUE(table.Contains({20, 0, 0}));
  EXPECT_FALSE(table.Contains({10, 0, 0}));
}

TEST(BlockTable, LeavesOutFacesThatCannotBeUsed) {
  MeshBlock block;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  block.positions_map = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {nan, 0, 0}, {90, 0, 0}};
  block.faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 7}};
  EXPECT_EQ(UsableFaces(block).size(), 1u);
  EXPECT_EQ(BoundsOf(block).max(), Eigen::Vector3f(1, 1, 0));
  block.faces.erase(block.faces.begin());
  EXPECT_TRUE(BoundsOf(block).isEmpty());
}

TEST(BlockTable, ASphereTouchesTheFarEndOfALongFace) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks({MakeTriangle({0.5, 0.5, 0}, {60, 0, 0}, {60, 1, 0})}, {});
  ASSERT_EQ(delta.mesh_blocks.size(), 2u);
  const Revision revision = scene.Commit(delta);
  for (const double x : {1.0, 5.0, 20.0, 40.0, 59.0}) {
    EXPECT_TRUE(Clearance(scene.World(revision), {x, 0.5, 0.2}).hit) << x;
  }
  const Body moving = SweptSphere(0.1, {{30, 0.5, 5}, {30, 0.5, -5}});
  EXPECT_TRUE(Ask(scene.World(revision), moving, {}).hit);
}

TEST(BlockTable, FacesOfAnyLengthAnswerAsLookingAtAllOfThemDoes) {
  Random random(test::TestSeed(11), 0);
  Scene scene;
  std::vector<Convex> triangles = TrianglesOfAllLengths(&random, 150);
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks(triangles, {});
  const Revision before = scene.Commit(delta);
  // Long ones come in a block of their own, far off.
  const Convex added = MakeTriangle({101, 1, 1}, {-30, 2, 0}, {-30, -2, 0});
  GraphDelta more;
  for (MeshBlock& block : test::Blocks({added}, {})) {
    if (!block.faces.empty()) more.mesh_blocks.push_back(std::move(block));
  }
  const Revision after = scene.Commit(more);
  std::vector<Convex> with_added = triangles;
  with_added.push_back(added);
  int near_count = 0;
  for (int i = 0; i < 400; ++i) {
    SCOPED_TRACE(i);
    const Vector3d center = test::RandomPose(&random, 25.0).position;
    const double before_m = SlowSphereClearance(center, 0.3, triangles);
    const double after_m = SlowSphereClearance(center, 0.3, with_added);
    EXPECT_NEAR(Clearance(scene.World(after), center).clearance_m, std::min(after_m, 2.0), 1e-6);
    EXPECT_NEAR(Clearance(scene.World(before), center).clearance_m, std::min(before_m, 2.0), 1e-6);
    near_count += after_m < 2.0 ? 1 : 0;
  }
  EXPECT_GT(near_count, 50);
}

TEST(BlockTable, MeasuresABlockOnceForAllRevisions) {
  Scene scene;
  Random random(test::TestSeed(12), 0);
  GraphDelta first;
  first.mesh_blocks = test::Blocks(TrianglesOfAllLengths(&random, 60), {});
  const int64_t block_count = static_cast<int64_t>(first.mesh_blocks.size());
  GraphDelta second;
  second.mesh_blocks = {first.mesh_blocks.front()};
  second.mesh_blocks[0].positions_map[0].z() -= 0.5f;
  const Revision before = scene.Commit(first);
  const Revision after = scene.Commit(second);
  const auto measured_count = [&](Revision revision) {
    Clearance(scene.World(revision), {0, 0, 0});
    return scene.cache().stats().measured_count;
  };
  EXPECT_EQ(measured_count(before), block_count);
  EXPECT_EQ(measured_count(before), block_count);
  EXPECT_EQ(measured_count(after), block_count + 1);
  EXPECT_EQ(measured_count(before), block_count + 1);
}

TEST(BlockTable, WhoWasStoppedWhileMeasuringGoesOnFromThere) {
  Scene scene;
  Random random(test::TestSeed(13), 0);
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks(TrianglesOfAllLengths(&random, 60), {});
  const int64_t block_count = static_cast<int64_t>(delta.mesh_blocks.size());
  const Revision revision = scene.Commit(delta);
  for (int round = 0; round < 3; ++round) {
    int asked_count = 0;
    const StopCheck stop = [&] {
      return ++asked_count <= 10 ? absl::OkStatus() : absl::DeadlineExceededError("late");
    };
    CollisionWorld world = scene.World(revision);
    EXPECT_EQ(world.Check(SphereAt(0.3, {0, 0, 0}), {}, stop).status().code(),
              absl::StatusCode::kDeadlineExceeded);
    EXPECT_EQ(scene.cache().stats().measured_count, 10 * (round + 1));
  }
  Clearance(scene.World(revision), {0, 0, 0});
  EXPECT_EQ(scene.cache().stats().measured_count, block_count);
}

}  // namespace
}  // namespace dsg::query
