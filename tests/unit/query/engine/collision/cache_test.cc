// SPDX-License-Identifier: Apache-2.0
// What is kept between questions, and that it stays within its bound.
#include "query/engine/collision/collision_cache.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using test::Scene;
using test::SphereAt;

std::vector<MeshBlock> Row(int first, int count) {
  std::vector<Convex> triangles;
  for (int i = first; i < first + count; ++i) {
    for (const Convex& tile : test::Rectangle({2.0 * i, 0, 0}, {1, 0, 0}, {0, 1, 0})) {
      triangles.push_back(tile);
    }
  }
  return test::Blocks(triangles, {});
}

TEST(CollisionCache, ReadsABlockOnceForAllRevisionsThatShareIt) {
  Scene scene;
  GraphDelta first;
  first.mesh_blocks = Row(0, 10);
  const Revision before = scene.Commit(first);
  GraphDelta second;
  second.mesh_blocks = Row(4, 1);
  second.mesh_blocks[0].positions_map[0].z() = 0.5f;
  const Revision after = scene.Commit(second);
  const Body all = SweptSphere(0.1, {{0, 0.5, 0.2}, {20, 0.5, 0.2}});
  CollisionScope scope;
  test::Ask(scene.World(before), all, scope);
  EXPECT_EQ(scene.cache().stats().read_count, 10);
  test::Ask(scene.World(before), all, scope);
  EXPECT_EQ(scene.cache().stats().read_count, 10);
  test::Ask(scene.World(after), all, scope);
  EXPECT_EQ(scene.cache().stats().read_count, 11);
  test::Ask(scene.World(before), all, scope);
  EXPECT_EQ(scene.cache().stats().read_count, 11);
}

TEST(CollisionCache, StaysWithinItsBoundAndAnswersTheSame) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = Row(0, 40);
  const Revision revision = scene.Commit(delta);
  CollisionCache small(4096);
  CollisionCache none(1);
  const Body all = SweptSphere(0.1, {{0, 0.5, 0.2}, {80, 0.5, 0.2}});
  for (CollisionCache* cache : {&small, &none}) {
    CollisionWorld world =
        CollisionWorld::Create(scene.ViewAt(revision), scene.At(revision), std::nullopt, cache);
    const auto hit = world.Check(all, {}, StopCheck());
    ASSERT_TRUE(hit.ok());
    EXPECT_NEAR(hit->clearance_m, 0.1, 1e-6);
    EXPECT_LE(cache->stats().bytes, 4096u);
  }
  EXPECT_GT(small.stats().piece_count, 2);
  EXPECT_EQ(none.stats().piece_count, 0);
}

TEST(CollisionCache, ForgetsRevisionsWithTheirViews) {
  Scene scene;
  CollisionCache cache;
  for (int i = 0; i < 5; ++i) {
    GraphDelta delta;
    delta.mesh_blocks = Row(i, 1);
    const Revision revision = scene.Commit(delta);
    const auto symbols = std::make_shared<SymbolTable>();
    const auto view = GraphView::Load(*scene.At(revision), symbols, StopCheck());
    ASSERT_TRUE(view.ok());
    CollisionWorld world = CollisionWorld::Create(*view, scene.At(revision), std::nullopt, &cache);
    ASSERT_TRUE(world.Check(SphereAt(0.1, {0, 0, 0}), {}, StopCheck()).ok());
  }
  EXPECT_EQ(cache.stats().revision_count, 1);
}

TEST(CollisionCache, MapsDoNotMix) {
  Scene one;
  Scene two;
  GraphDelta delta;
  delta.mesh_blocks = Row(0, 1);
  const Revision in_one = one.Commit(delta);
  delta.mesh_blocks[0].positions_map[0].z() = 1.0f;
  const Revision in_two = two.Commit(delta);
  EXPECT_EQ(in_one, in_two);
  CollisionCache cache;
  std::vector<double> clearances_m;
  for (Scene* scene : {&one, &two}) {
    CollisionWorld world =
        CollisionWorld::Create(scene->ViewAt(in_one), scene->At(in_one), std::nullopt, &cache);
    clearances_m.push_back(world.Check(SphereAt(0.1, {0, 0, 1.2}), {}, StopCheck())->clearance_m);
  }
  EXPECT_NEAR(clearances_m[0], 1.1, 1e-6);
  EXPECT_LT(clearances_m[1], 0.5);
}

TEST(CollisionCache, ServesManyThreads) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = Row(0, 20);
  const Revision revision = scene.Commit(delta);
  CollisionCache cache(8192);
  const auto view = scene.ViewAt(revision);
  const auto snapshot = scene.At(revision);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 50; ++i) {
        CollisionWorld world = CollisionWorld::Create(view, snapshot, std::nullopt, &cache);
        const Body body = SphereAt(0.1, {2.0 * ((i + 5 * t) % 20) + 0.5, 0.5, 0.3});
        const auto hit = world.Check(body, {}, StopCheck());
        EXPECT_TRUE(hit.ok());
        EXPECT_NEAR(hit->clearance_m, 0.2, 1e-6);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace dsg::query
