// SPDX-License-Identifier: Apache-2.0
#include "query/view/space_index.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/random.h"
#include "tests/support/temp_folder.h"

namespace dsg::query {
namespace {

Eigen::Vector3d RandomPoint(Random* random, double size_m) {
  return {random->Uniform(-size_m, size_m), random->Uniform(-size_m, size_m),
          random->Uniform(-size_m, size_m)};
}

TEST(CoarseBox, IsNeverFartherThanTheBoxItStandsFor) {
  Random random(test::TestSeed(1), 1);
  for (int i = 0; i < 20'000; ++i) {
    // Up to the largest coordinates that a map takes, where floats are coarse.
    const double size_m = std::pow(10.0, random.Uniform(-3, 6.3));
    const Eigen::Vector3d corner = RandomPoint(&random, size_m);
    const Eigen::Vector3d extent = RandomPoint(&random, 1.0).cwiseAbs();
    const Box3d box(corner, corner + (random.Chance(0.3) ? Eigen::Vector3d::Zero() : extent));
    const CoarseBox coarse(box);
    const Eigen::Vector3d point =
        random.Chance(0.3) ? box.min() : corner + RandomPoint(&random, 2.0);
    ASSERT_LE(coarse.DistanceBound(point), DistanceToBox(point, box));
    const Eigen::Vector3d other = RandomPoint(&random, size_m);
    const Box3d question(other.cwiseMin(box.max()), other.cwiseMax(box.max()));
    ASSERT_TRUE(question.intersects(box));
    ASSERT_TRUE(coarse.MayTouch(question));
  }
}

TEST(CoarseBox, IsInfinitelyFarWhenEmpty) {
  EXPECT_TRUE(std::isinf(CoarseBox().DistanceBound(Eigen::Vector3d::Zero())));
  EXPECT_FALSE(
      CoarseBox().MayTouch(Box3d(Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9))));
}

TEST(SpaceTree, FindsWhatStandsAtTheEdgeOfTheWorld) {
  std::vector<ViewNode> nodes(3);
  SpaceTree tree;
  for (size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].id = NodeId('p', i);
    nodes[i].layer = layers::kPlaces;
    // The grid of the curve repeats long before the last of these.
    nodes[i].map_T_node.position = {2.0e6 * static_cast<double>(i) - 2.0e6, -0.0, 1e-9};
    tree.Put(MakeSpaceEntry(nodes[i], /*is_agent=*/false));
  }
  std::vector<NodeId> found;
  VisitNearest(
      tree, {RangeOf(layers::kPlaces)}, {2.0e6, 0, 0}, 1e9,
      [&](NodeId id) { return &nodes[id.index()]; },
      [&](const ViewNode& node, double) {
        found.push_back(node.id);
        return true;
      });
  EXPECT_EQ(found, (std::vector<NodeId>{nodes[2].id, nodes[1].id, nodes[0].id}));
}

}  // namespace
}  // namespace dsg::query
