// SPDX-License-Identifier: Apache-2.0
// Nodes in a box, found by the cells of the store: what a look at every node finds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "schema/base/random.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

// Mostly of a building, and some as far and as large as a map takes; corners on edges of cells too.
Eigen::Vector3d RandomCorner(Random* random) {
  constexpr double kFarM = 2e6;
  Eigen::Vector3d corner;
  for (int axis = 0; axis < 3; ++axis) {
    corner[axis] = random->Chance(0.05) ? random->Uniform(-kFarM, kFarM) : random->Uniform(-20, 20);
    if (random->Chance(0.3)) corner[axis] = std::round(corner[axis]);
  }
  return corner;
}

Box3d RandomBox(Random* random) {
  Box3d box(RandomCorner(random));
  if (random->Chance(0.2)) return box;
  if (random->Chance(0.1)) return box.extend(RandomCorner(random));
  const double size_m = std::exp2(random->Integer(-4, 6));
  return box.extend(box.min() + size_m * Eigen::Vector3d(random->Uniform(), random->Uniform(), 1));
}

class NodeCells : public OnEveryBackend {
 protected:
  void Put(NodeId id, const Box3d& box_map, GraphDelta* delta) {
    Node node = MakeNode(id, layers::kObjects, kinds::kObject, "", box_map);
    nodes_[id] = node;
    delta->nodes.push_back(std::move(node));
  }

  std::vector<NodeId> Listed(const Box3d& box_map) {
    NodeFilter filter;
    filter.layer = layers::kObjects;
    filter.box_map = box_map;
    std::vector<NodeId> ids;
    OrDie(map_.Latest()->ScanNodes(filter, NodeId(), {}, [&](const Node& node) {
      ids.push_back(node.id);
      return true;
    }));
    return ids;
  }

  std::vector<NodeId> Naive(const Box3d& box_map) const {
    std::vector<NodeId> ids;
    for (const auto& [id, node] : nodes_) {
      if (node.BoxMap().intersects(box_map)) ids.push_back(id);
    }
    return ids;
  }

  std::map<NodeId, Node> nodes_;
  TestMap map_{GetParam()};
};

DSG_ON_EVERY_BACKEND(NodeCells);

TEST_P(NodeCells, FindWhatALookAtEveryNodeFinds) {
  Random random(RecordSeed(), 0);
  for (int commit = 0; commit < 6; ++commit) {
    GraphDelta delta;
    // Some of them move from where they were, and some go.
    for (int i = 0; i < 300; ++i) {
      Put(NodeId('O', static_cast<uint64_t>(commit * 200 + i)), RandomBox(&random), &delta);
    }
    for (int i = 0; i < 40 && commit > 0; ++i) {
      const NodeId gone('O', static_cast<uint64_t>((commit - 1) * 200 + i));
      delta.retirements.push_back({gone, std::nullopt});
      nodes_.erase(gone);
    }
    map_.MustCommit(std::move(delta));
    for (int i = 0; i < 300; ++i) {
      const Box3d box = RandomBox(&random);
      ASSERT_EQ(Listed(box), Naive(box)) << box.min().transpose() << " " << box.max().transpose();
    }
  }
  EXPECT_EQ(map_.Problems(), "");
}

TEST_P(NodeCells, FindAllThatTouchesTheWholeWorld) {
  Random random(RecordSeed(), 1);
  GraphDelta delta;
  for (uint64_t i = 1; i <= 500; ++i) Put(NodeId('O', i), RandomBox(&random), &delta);
  map_.MustCommit(std::move(delta));
  const Box3d world(Eigen::Vector3d::Constant(-1e300), Eigen::Vector3d::Constant(1e300));
  EXPECT_EQ(Listed(world).size(), 500u);
}

}  // namespace
}  // namespace dsg::test
