// SPDX-License-Identifier: Apache-2.0
// Ids for names: stable, readable where a name is a number, never given twice.
#include "ingest/pipeline/agent_namer.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

Node Agent(NodeId id, const std::string& name, const std::string& kind) {
  Node node;
  node.id = id;
  node.name = name;
  node.kind = kind;
  return node;
}

TEST(AgentNamer, GivesANumberItsOwnIndex) {
  AgentNamer namer({});
  EXPECT_EQ(namer.Assign("12", kinds::kHuman), NodeId('H', 12));
  EXPECT_EQ(namer.Assign("0", kinds::kHuman), NodeId('H', 0));
  EXPECT_EQ(namer.Assign("12", kinds::kRobot), NodeId('r', 12));
  EXPECT_EQ(namer.Assign("12", kinds::kVehicle), NodeId('V', 12));
  EXPECT_EQ(namer.Assign("12", kinds::kAnimal), NodeId('N', 12));
  EXPECT_EQ(namer.Assign("12", kinds::kHuman), NodeId('H', 12));
}

TEST(AgentNamer, GivesOtherNamesTheIndexAboveTheLargest) {
  AgentNamer namer({});
  EXPECT_EQ(namer.Assign("body", kinds::kRobot), NodeId('r', 0));
  EXPECT_EQ(namer.Assign("7", kinds::kHuman), NodeId('H', 7));
  EXPECT_EQ(namer.Assign("anna", kinds::kHuman), NodeId('H', 8));
  EXPECT_EQ(namer.Assign("007", kinds::kHuman), NodeId('H', 9));
  EXPECT_EQ(namer.Assign("-1", kinds::kHuman), NodeId('H', 10));
  EXPECT_EQ(namer.Assign("99999999999999999999", kinds::kHuman), NodeId('H', 11));
  EXPECT_EQ(namer.Assign("1000000", kinds::kHuman), NodeId('H', 12));
}

TEST(AgentNamer, NeverGivesATakenIndexToANumber) {
  AgentNamer namer({});
  EXPECT_EQ(namer.Assign("anna", kinds::kHuman), NodeId('H', 0));
  EXPECT_EQ(namer.Assign("0", kinds::kHuman), NodeId('H', 1));
  EXPECT_EQ(namer.Assign("1", kinds::kHuman), NodeId('H', 2));
}

TEST(AgentNamer, GivesANameThatReadsAsAnIdThatIdWhileItIsFree) {
  AgentNamer namer({});
  EXPECT_EQ(namer.Assign("H5", kinds::kHuman), NodeId('H', 5));
  EXPECT_EQ(namer.Assign("anna", kinds::kHuman), NodeId('H', 6));
  EXPECT_TRUE(namer.misleading().empty());
  EXPECT_EQ(namer.Assign("H6", kinds::kHuman), NodeId('H', 7));
  EXPECT_EQ(namer.Assign("H6", kinds::kRobot), NodeId('r', 0));
  EXPECT_EQ(namer.Assign("r9", kinds::kHuman), NodeId('H', 8));
  const std::map<std::string, NodeId> expected = {{"H6", NodeId('H', 7)}, {"r9", NodeId('H', 8)}};
  EXPECT_EQ(namer.misleading(), expected);
}

TEST(AgentNamer, FindsTheAgentsOfTheMap) {
  AgentNamer namer(
      {Agent(NodeId('H', 3), "anna", kinds::kHuman), Agent(NodeId('H', 9), "3", kinds::kHuman)});
  EXPECT_EQ(namer.Assign("anna", kinds::kHuman), NodeId('H', 3));
  EXPECT_EQ(namer.Assign("3", kinds::kHuman), NodeId('H', 9));
  EXPECT_EQ(namer.Assign("berta", kinds::kHuman), NodeId('H', 10));
}

TEST(AgentNamer, NamesAsBeforeWhenTheMapHoldsPartOfTheLog) {
  const std::vector<std::string> names = {"5",     "anna", "6",     "H7",  "7",
                                          "berta", "3",    "carla", "H11", "anna"};
  AgentNamer whole({});
  std::vector<NodeId> expected;
  for (const std::string& name : names) expected.push_back(whole.Assign(name, kinds::kHuman));
  for (size_t known_count = 0; known_count <= names.size(); ++known_count) {
    std::vector<Node> known;
    for (size_t i = 0; i < known_count; ++i) {
      known.push_back(Agent(expected[i], names[i], kinds::kHuman));
    }
    AgentNamer resumed(known);
    for (size_t i = 0; i < names.size(); ++i) {
      EXPECT_EQ(resumed.Assign(names[i], kinds::kHuman), expected[i]) << known_count;
    }
  }
}

TEST(AgentNamer, KeepsAPreferredIdWhileItIsFree) {
  AgentNamer namer({Agent(NodeId('r', 0), "a", kinds::kRobot)});
  EXPECT_EQ(namer.AssignPreferring(NodeId('r', 0), "a", kinds::kRobot), NodeId('r', 0));
  EXPECT_EQ(namer.AssignPreferring(NodeId('r', 0), "b", kinds::kRobot), NodeId('r', 1));
  EXPECT_EQ(namer.AssignPreferring(NodeId('r', 9), "c", kinds::kRobot), NodeId('r', 9));
}

}  // namespace
}  // namespace dsg::ingest
