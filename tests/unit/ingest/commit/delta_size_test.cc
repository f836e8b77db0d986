// SPDX-License-Identifier: Apache-2.0
// Cutting of large deltas.
#include "ingest/commit/delta_size.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

GraphDelta Objects(int count, size_t text_bytes) {
  GraphDelta delta;
  for (int i = 0; i < count; ++i) {
    Node node;
    node.id = NodeId('O', static_cast<uint64_t>(i));
    node.layer = layers::kObjects;
    node.kind = kinds::kObject;
    node.attributes["note"] = std::string(text_bytes, 'x');
    delta.nodes.push_back(node);
  }
  return delta;
}

TEST(SplitToSize, LeavesASmallDeltaWhole) { EXPECT_EQ(SplitToSize(Objects(100, 10)).size(), 1u); }

TEST(SplitToSize, CutsByBytesWhereRowsAreHeavy) {
  const std::vector<GraphDelta> parts = SplitToSize(Objects(1000, 20'000));
  size_t node_count = 0;
  for (const GraphDelta& part : parts) {
    EXPECT_LE(EstimateBytes(part), kDeltaBytesMax);
    EXPECT_FALSE(part.empty());
    node_count += part.nodes.size();
  }
  EXPECT_EQ(node_count, 1000u);
  EXPECT_GE(parts.size(), 7u);
}

TEST(SplitToSize, CutsByRowsWhereThereAreMany) {
  const std::vector<GraphDelta> parts = SplitToSize(Objects(30'000, 0));
  EXPECT_GE(parts.size(), 3u);
  for (const GraphDelta& part : parts) EXPECT_LE(part.nodes.size(), kDeltaRowsMax);
}

TEST(SplitToSize, KeepsARowThatIsTooLargeOnItsOwn) {
  GraphDelta delta = Objects(3, 10);
  delta.nodes[1].attributes["note"] = std::string(5 << 20, 'x');
  const std::vector<GraphDelta> parts = SplitToSize(delta);
  size_t node_count = 0;
  for (const GraphDelta& part : parts) node_count += part.nodes.size();
  EXPECT_EQ(node_count, 3u);
}

TEST(SplitToSize, PacksMeshesByBytesAfterTheNodes) {
  GraphDelta delta = Objects(10, 10);
  for (int i = 0; i < 100; ++i) {
    MeshBlock& block = delta.mesh_blocks.emplace_back();
    block.index = {i, 0, 0};
    block.positions_map.resize(2000);
  }
  const std::vector<GraphDelta> parts = SplitToSize(delta);
  ASSERT_EQ(parts.size(), 1 + 100u * 2000u * 64u / kDeltaBytesMax + 1);
  EXPECT_EQ(parts[0].nodes.size(), 10u);
  size_t count = 0;
  for (const GraphDelta& part : parts) {
    EXPECT_LE(EstimateBytes(part), kDeltaBytesMax);
    for (const MeshBlock& block : part.mesh_blocks) {
      EXPECT_EQ(block.index.x, static_cast<int>(count++));
    }
  }
  EXPECT_EQ(count, 100u);
}

TEST(SplitToSize, CutsLongTrajectories) {
  GraphDelta delta;
  delta.appends.push_back({NodeId('r', 0), {}});
  for (int i = 0; i < 50'000; ++i) {
    TimedPose pose;
    pose.time_ns = i;
    delta.appends[0].poses.push_back(pose);
  }
  TimeNs next = 0;
  for (const GraphDelta& part : SplitToSize(delta)) {
    EXPECT_LE(EstimateBytes(part), kDeltaBytesMax);
    for (const TimedPose& pose : part.appends.at(0).poses) EXPECT_EQ(pose.time_ns, next++);
  }
  EXPECT_EQ(next, 50'000);
}

}  // namespace
}  // namespace dsg::ingest
