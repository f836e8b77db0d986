// SPDX-License-Identifier: Apache-2.0
// What poses become in a delta.
#include "ingest/pipeline/delta_builder.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

PoseMeasurement Pose(TimeNs time_ns, double x, const std::string& kind = kinds::kHuman) {
  PoseMeasurement measurement;
  measurement.agent_name = "anna";
  measurement.agent_kind = kind;
  measurement.pose.time_ns = time_ns;
  measurement.pose.map_T_agent.position = {x, 0, 0};
  return measurement;
}

TEST(DeltaBuilder, MakesANodeWithTheFirstPoseAndTellsItsEndOnce) {
  DeltaBuilder builder(0.0);
  builder.AddPose(NodeId('H', 1), Pose(10, 1.0));
  builder.AddPose(NodeId('H', 1), Pose(20, 2.0));
  EXPECT_EQ(builder.pose_count(), 2);
  const GraphDelta first = builder.Take({});
  ASSERT_EQ(first.nodes.size(), 1u);
  EXPECT_EQ(first.nodes[0].valid, (Interval{10, kTimeMax}));
  EXPECT_EQ(first.nodes[0].first_observed_ns, 10);
  EXPECT_EQ(first.nodes[0].last_observed_ns, 20);
  EXPECT_EQ(first.nodes[0].observation_count, 2);
  EXPECT_EQ(first.nodes[0].layer, layers::kAgents);
  EXPECT_EQ(first.appends.at(0).poses.size(), 2u);
  EXPECT_TRUE(builder.TakeNodes().empty()) << "nothing happened since";
  builder.AddPose(NodeId('H', 1), Pose(30, 3.0));
  const GraphDelta second = builder.Take({});
  EXPECT_TRUE(second.nodes.empty());
  EXPECT_EQ(second.appends.at(0).poses.size(), 1u);
  const GraphDelta last = builder.TakeNodes();
  ASSERT_EQ(last.nodes.size(), 1u);
  EXPECT_EQ(last.nodes[0].last_observed_ns, 30);
  EXPECT_EQ(last.nodes[0].observation_count, 3);
  EXPECT_EQ(last.nodes[0].map_T_node.position.x(), 3.0);
}

TEST(DeltaBuilder, StandsHumansOnTheirFeetAndRobotsInACube) {
  DeltaBuilder planar(0.0);
  planar.AddPose(NodeId('H', 1), Pose(10, 0.0));
  const Box3d standing = planar.Take({}).nodes.at(0).box_node;
  EXPECT_EQ(standing.min(), Eigen::Vector3d(-0.25, -0.25, 0.0));
  EXPECT_EQ(standing.max(), Eigen::Vector3d(0.25, 0.25, 1.8));
  DeltaBuilder helmets(1.81);
  helmets.AddPose(NodeId('H', 1), Pose(10, 0.0));
  const Box3d hanging = helmets.Take({}).nodes.at(0).box_node;
  EXPECT_EQ(hanging.min().z(), -1.81);
  EXPECT_EQ(hanging.max().z(), 0.0);
  DeltaBuilder robot(0.0);
  robot.AddPose(NodeId('r', 0), Pose(10, 0.0, kinds::kRobot));
  const Box3d cube = robot.Take({}).nodes.at(0).box_node;
  EXPECT_EQ(cube.min(), Eigen::Vector3d::Constant(-0.25));
  EXPECT_EQ(cube.max(), Eigen::Vector3d::Constant(0.25));
}

TEST(DeltaBuilder, SortsAgentsWhateverTheOrderOfPoses) {
  DeltaBuilder builder(0.0);
  builder.AddPose(NodeId('H', 9), Pose(10, 0.0));
  builder.AddPose(NodeId('H', 2), Pose(10, 0.0));
  const GraphDelta delta = builder.Take({});
  EXPECT_EQ(delta.nodes.at(0).id, NodeId('H', 2));
  EXPECT_EQ(delta.appends.at(0).agent, NodeId('H', 2));
  EXPECT_EQ(builder.agent_count(), 2);
}

}  // namespace
}  // namespace dsg::ingest
