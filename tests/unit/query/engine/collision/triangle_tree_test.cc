// SPDX-License-Identifier: Apache-2.0
// The tree finds what looking at every triangle finds.
#include "query/engine/collision/shapes.h"

#include <gtest/gtest.h>

#include <set>

#include "schema/base/random.h"
#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

TriangleTree RandomTree(Random* random, int face_count) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
  for (int i = 0; i < face_count; ++i) {
    const Pose3d pose = test::RandomPose(random, 2.0);
    const auto first = static_cast<uint32_t>(vertices.size());
    vertices.push_back((pose * Eigen::Vector3d(0, 0, 0)).cast<float>());
    vertices.push_back((pose * Eigen::Vector3d(0.3, 0, 0)).cast<float>());
    vertices.push_back((pose * Eigen::Vector3d(0, 0.2, 0)).cast<float>());
    faces.push_back({first, first + 1, first + 2});
  }
  return TriangleTree(std::move(vertices), std::move(faces));
}

TEST(TriangleTree, FindsAllThatAreNear) {
  Random random(test::TestSeed(3), 0);
  for (int face_count : {0, 1, 4, 5, 100, 1000}) {
    const TriangleTree tree = RandomTree(&random, face_count);
    EXPECT_EQ(tree.face_count(), face_count);
    for (int i = 0; i < 50; ++i) {
      const Convex box = MakeBox(test::RandomPose(&random, 3.0), test::RandomBox(&random));
      const Pose3d pose = test::RandomPose(&random, 1.0);
      const double reach_m = random.Uniform(0.0, 0.5);
      std::set<int> still;
      std::set<int> posed;
      tree.ForEachNear(box.bounds, &reach_m, [&](int face) { still.insert(face); });
      tree.ForEachNear(pose, box.bounds, &reach_m, [&](int face) { posed.insert(face); });
      for (int face = 0; face < face_count; ++face) {
        if (Distance(tree.Triangle(face), box).distance_m <= reach_m) {
          EXPECT_TRUE(still.contains(face));
        }
        if (Distance(tree.Triangle(face, pose), box).distance_m <= reach_m) {
          EXPECT_TRUE(posed.contains(face));
        }
      }
    }
  }
}

TEST(TriangleTree, LooksAtFewOfMany) {
  Random random(test::TestSeed(4), 0);
  const TriangleTree tree = RandomTree(&random, 4000);
  int visited_count = 0;
  const double reach_m = 0.05;
  tree.ForEachNear(Box3d(Eigen::Vector3d(0.5, 0.5, 0.5)), &reach_m, [&](int) { ++visited_count; });
  EXPECT_LT(visited_count, 200);
}

TEST(TriangleTree, FindsPairsOfTwoTrees) {
  Random random(test::TestSeed(5), 0);
  for (int i = 0; i < 20; ++i) {
    const TriangleTree a = RandomTree(&random, 60);
    const TriangleTree b = RandomTree(&random, 90);
    const Pose3d pose = test::RandomPose(&random, 1.0);
    const double reach_m = 0.1;
    std::set<std::pair<int, int>> found;
    ForEachNearPair(
        a, pose, b, &reach_m, [] { return true; }, [&](int m, int f) { found.emplace(m, f); });
    for (int m = 0; m < a.face_count(); ++m) {
      for (int f = 0; f < b.face_count(); ++f) {
        if (Distance(a.Triangle(m, pose), b.Triangle(f)).distance_m > reach_m) continue;
        EXPECT_TRUE(found.contains({m, f}));
      }
    }
  }
}

}  // namespace
}  // namespace dsg::query
