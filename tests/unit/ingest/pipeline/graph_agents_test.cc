// SPDX-License-Identifier: Apache-2.0
// Agents of ready-made graphs among the agents of a map.

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

Node Robot(uint64_t index, const std::string& name) {
  Node node;
  node.id = NodeId('r', index);
  node.layer = layers::kAgents;
  node.kind = kinds::kRobot;
  node.name = name;
  return node;
}

GraphDelta RobotDelta() {
  GraphDelta delta;
  delta.nodes = {Robot(0, "a")};
  delta.appends.push_back({NodeId('r', 0), {TimedPose{}}});
  delta.stays.push_back({NodeId('r', 0), {}, NodeId('R', 0), 0, 1});
  delta.edges.push_back({NodeId('r', 0), relations::kNear, NodeId('O', 0), 1.0, {}, {}, 0});
  return delta;
}

TEST(RenameAgents, KeepsFreeIds) {
  AgentNamer namer({});
  GraphDelta delta = RobotDelta();
  ASSERT_TRUE(RenameAgents(&namer, &delta).ok());
  EXPECT_EQ(delta.nodes[0].id, NodeId('r', 0));
}

TEST(RenameAgents, MovesAnAgentWhoseIdIsAnothers) {
  AgentNamer namer({Robot(0, "b"), Robot(4, "c")});
  GraphDelta delta = RobotDelta();
  ASSERT_TRUE(RenameAgents(&namer, &delta).ok());
  EXPECT_EQ(delta.nodes[0].id, NodeId('r', 5));
  EXPECT_EQ(delta.appends[0].agent, NodeId('r', 5));
  EXPECT_EQ(delta.stays[0].agent, NodeId('r', 5));
  EXPECT_EQ(delta.stays[0].room, NodeId('R', 0));
  EXPECT_EQ(delta.edges[0].source, NodeId('r', 5));
}

TEST(RenameAgents, FindsTheSameAgentByName) {
  AgentNamer namer({Robot(7, "a")});
  GraphDelta delta = RobotDelta();
  ASSERT_TRUE(RenameAgents(&namer, &delta).ok());
  EXPECT_EQ(delta.nodes[0].id, NodeId('r', 7));
}

TEST(RenameAgents, RefusesTwoAgentsOfOneName) {
  AgentNamer namer({});
  GraphDelta delta = RobotDelta();
  delta.nodes.push_back(Robot(1, "a"));
  EXPECT_EQ(ReasonOf(RenameAgents(&namer, &delta)), Reason::kFileMalformed);
}

}  // namespace
}  // namespace dsg::ingest
