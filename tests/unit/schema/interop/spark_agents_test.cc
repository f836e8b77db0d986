// SPDX-License-Identifier: Apache-2.0
// Trajectories and stays made from the pose nodes of a Spark-DSG file.
#include "schema/interop/spark_agents.h"

#include <gtest/gtest.h>

#include "schema/interop/spark_to_delta.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

// Places p0 and p1 in room R0, p2 in no room; poses are added by the tests.
class SparkAgents : public testing::Test {
 protected:
  void SetUp() override {
    AddNode(SparkClass::kRoom, NodeId('R', 0), 4);
    for (const uint64_t i : {0, 1, 2}) AddNode(SparkClass::kPlace, NodeId('p', i), 3);
    AddEdge(NodeId('R', 0), NodeId('p', 0));
    AddEdge(NodeId('R', 0), NodeId('p', 1));
  }

  SparkNode& AddNode(SparkClass type, NodeId id, int64_t layer, uint32_t partition = 0) {
    SparkNode node;
    node.type = type;
    node.id = id.value;
    node.key = {layer, partition};
    graph_.nodes.push_back(node);
    return graph_.nodes.back();
  }

  void AddEdge(NodeId a, NodeId b) { graph_.edges.push_back({a.value, b.value, false, 1.0, ""}); }

  // The place may be empty.
  void AddPose(TimeNs time_ns, NodeId place, char letter = 'a') {
    const NodeId id(letter, next_pose_++);
    SparkNode& pose = AddNode(SparkClass::kAgent, id, 2, static_cast<uint32_t>(letter));
    pose.stamp_ns = time_ns;
    pose.position = {1e-9 * static_cast<double>(time_ns), 0, 0};
    if (!place.empty()) AddEdge(id, place);
  }

  ImportedGraph Import() {
    auto imported = SparkToDelta(graph_, "g.json", 2.0);
    EXPECT_TRUE(imported.ok()) << imported.status();
    if (!imported.ok()) return {};
    EXPECT_TRUE(CheckImport(*imported).ok()) << CheckImport(*imported);
    return *std::move(imported);
  }

  static constexpr TimeNs kSecond = kNsPerSecond;
  const NodeId r0_{'r', 0};
  const NodeId room_{'R', 0};
  const NodeId p0_{'p', 0};
  const NodeId p1_{'p', 1};
  const NodeId p2_{'p', 2};
  SparkGraph graph_;
  uint64_t next_pose_ = 0;
};

TEST_F(SparkAgents, ATimeThatNoMapHoldsBesideTheOthersIsLeftOut) {
  for (int i = 1; i <= 5; ++i) AddPose(i * kSecond, p0_);
  AddPose(int64_t{11} * 365 * 86400 * kSecond, p0_);
  const ImportedGraph imported = Import();
  ASSERT_EQ(imported.delta.appends.size(), 1u);
  EXPECT_EQ(imported.delta.appends[0].poses.size(), 5u);
  int named_count = 0;
  for (const Skipped& skipped : imported.skipped) {
    for (const std::string& one : skipped.first) {
      named_count += one.find("5 years") != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_EQ(named_count, 1);
}

TEST_F(SparkAgents, MergesEqualPlacesAndEndsAStayWhereTheNextBegins) {
  AddPose(10 * kSecond, p0_);
  AddPose(11 * kSecond, p0_);
  AddPose(12 * kSecond, p1_);
  AddPose(13 * kSecond, p2_);
  const std::vector<Stay> expected = {{r0_, p0_, room_, 10 * kSecond, 12 * kSecond},
                                      {r0_, p1_, room_, 12 * kSecond, 13 * kSecond},
                                      {r0_, p2_, NodeId(), 13 * kSecond, 13 * kSecond + 1}};
  EXPECT_EQ(Import().delta.stays, expected);
}

TEST_F(SparkAgents, EndsAStayRightAfterTheLastPoseBeforeAGap) {
  AddPose(10 * kSecond, p0_);
  AddPose(12 * kSecond, p0_);
  AddPose(14 * kSecond + 1, p0_);
  const std::vector<Stay> expected = {{r0_, p0_, room_, 10 * kSecond, 12 * kSecond + 1},
                                      {r0_, p0_, room_, 14 * kSecond + 1, 14 * kSecond + 2}};
  EXPECT_EQ(Import().delta.stays, expected);
}

TEST_F(SparkAgents, HasNoStayWhereAPoseHasNoPlace) {
  AddPose(10 * kSecond, p0_);
  AddPose(11 * kSecond, NodeId());
  AddPose(12 * kSecond, p0_);
  const std::vector<Stay> expected = {{r0_, p0_, room_, 10 * kSecond, 11 * kSecond},
                                      {r0_, p0_, room_, 12 * kSecond, 12 * kSecond + 1}};
  EXPECT_EQ(Import().delta.stays, expected);
}

TEST_F(SparkAgents, TakesTheRoomOfAPoseThatHasNoPlace) {
  AddPose(10 * kSecond, room_);
  const ImportedGraph imported = Import();
  const std::vector<Stay> expected = {{r0_, NodeId(), room_, 10 * kSecond, 10 * kSecond + 1}};
  EXPECT_EQ(imported.delta.stays, expected);
  EXPECT_EQ(imported.delta.edges.back().relation, "POSE_IN");
}

TEST_F(SparkAgents, CutsLongStays) {
  for (TimeNs t = 0; t <= 3700; t += 2) AddPose(t * kSecond, p0_);
  const std::vector<Stay> expected = {{r0_, p0_, room_, 0, kStayNsMax},
                                      {r0_, p0_, room_, kStayNsMax, 3700 * kSecond + 1}};
  EXPECT_EQ(Import().delta.stays, expected);
}

TEST_F(SparkAgents, KeepsTheFirstOfEqualAndBackwardTimesAndSaysSo) {
  AddPose(10 * kSecond, p0_);
  AddPose(11 * kSecond, p0_);
  AddPose(11 * kSecond, p1_);
  AddPose(9 * kSecond, p1_);
  AddPose(12 * kSecond, p0_);
  const ImportedGraph imported = Import();
  ASSERT_EQ(imported.delta.appends.size(), 1u);
  ASSERT_EQ(imported.delta.appends[0].poses.size(), 3u);
  EXPECT_EQ(imported.delta.appends[0].poses[2].map_T_agent.position.x(), 12.0);
  EXPECT_EQ(imported.pose_count, 5);
  ASSERT_EQ(imported.delta.stays.size(), 1u);
  EXPECT_NE(imported.notes.back().find("2 poses are no later"), std::string::npos);
}

TEST_F(SparkAgents, MakesOneRobotForEachLetterWithIdsThatAreFree) {
  AddNode(SparkClass::kObject, NodeId('r', 1), 2);
  AddPose(10 * kSecond, p0_, 'a');
  AddPose(10 * kSecond, p0_, 'b');
  AddPose(10 * kSecond, p0_, 'c');
  const ImportedGraph imported = Import();
  EXPECT_EQ(NodeNamed(imported, "r0").name, "a");
  EXPECT_EQ(NodeNamed(imported, "r1").kind, kinds::kObject);
  EXPECT_EQ(NodeNamed(imported, "r2").name, "b");
  EXPECT_EQ(NodeNamed(imported, "r3").name, "c");
  EXPECT_EQ(NodeNamed(imported, "r3").layer, layers::kAgents);
  EXPECT_EQ(imported.delta.appends.size(), 3u);
}

TEST_F(SparkAgents, KeepsPosesWithoutATimeAsNodesOnly) {
  AddPose(10 * kSecond, p0_);
  graph_.nodes.back().stamp_ns.reset();
  const ImportedGraph imported = Import();
  EXPECT_TRUE(imported.delta.appends.empty());
  EXPECT_EQ(NodeNamed(imported, "a0").kind, "agent_pose");
  EXPECT_EQ(imported.notes.back(), "1 poses have no time and are in no track");
}

}  // namespace
}  // namespace dsg
