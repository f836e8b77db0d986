// SPDX-License-Identifier: Apache-2.0
// The whole program on a small store on disk: meetings, search, ways, obstacles, future, change.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "query/cli/run.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::MakeEdge;
using test::MakeNode;
using test::Outcome;

Node Thing(NodeId id, int32_t class_id, const std::string& class_name, double x_m, double z_m) {
  Node node = MakeNode(id, kinds::kObject, class_name, x_m);
  node.map_T_node.position.z() = z_m;
  node.class_id = class_id;
  node.class_name = class_name;
  node.box_node = Box3d(Eigen::Vector3d(-0.2, -0.2, -0.2), Eigen::Vector3d(0.2, 0.2, 0.2));
  return node;
}

TrajectoryAppend WalkAlongX(NodeId agent, double from_x_m, double speed_m_s) {
  TrajectoryAppend walk{.agent = agent, .poses = {}};
  for (int i = 0; i <= 20; ++i) {
    TimedPose pose;
    pose.time_ns = i * kNsPerSecond / 2;
    pose.map_T_agent.position = Eigen::Vector3d(from_x_m + 0.5 * i * speed_m_s, 0.0, 0.0);
    walk.poses.push_back(pose);
  }
  return walk;
}

constexpr NodeId kBuilding('B', 0), kHall('R', 1), kKitchen('R', 2), kTable('O', 1), kCup('O', 2);
constexpr NodeId kBath('R', 3);

// Ten places a metre apart: five in the hall, five in the kitchen. Ann and bob walk towards one
// another and pass at x = 4.5.
GraphDelta House() {
  GraphDelta delta;
  delta.map = "house";
  delta.session_id = "test";
  delta.sequence = 1;
  delta.nodes = {MakeNode(kBuilding, kinds::kBuilding, "house", 5.0),
                 MakeNode(kHall, kinds::kRoom, "hall", 2.0),
                 MakeNode(kKitchen, kinds::kRoom, "kitchen", 7.0),
                 MakeNode(kBath, kinds::kRoom, "", 20.0),
                 MakeNode(NodeId('H', 1), kinds::kHuman, "ann", 0.0),
                 MakeNode(NodeId('H', 2), kinds::kHuman, "bob", 9.0)};
  // As maps made from images have it: a class and no name.
  delta.labels = {{5, "bathroom"}};
  delta.nodes[3].class_id = 5;
  delta.nodes[3].class_name = "bathroom";
  delta.edges = {MakeEdge(kBuilding, relations::kContains, kHall),
                 MakeEdge(kBuilding, relations::kContains, kKitchen),
                 MakeEdge(kHall, relations::kAdjacent, kKitchen)};
  for (uint64_t i = 0; i < 10; ++i) {
    Node place = MakeNode(NodeId('p', i), kinds::kPlace, "", static_cast<double>(i));
    place.place.emplace();
    place.place->clearance_m = 1.0;
    delta.nodes.push_back(place);
    delta.edges.push_back(MakeEdge(i < 5 ? kHall : kKitchen, relations::kContains, place.id));
    if (i > 0) {
      delta.edges.push_back(MakeEdge(NodeId('p', i - 1), relations::kTraversable, place.id));
    }
  }
  delta.appends = {WalkAlongX(NodeId('H', 1), 0.0, 0.9), WalkAlongX(NodeId('H', 2), 9.0, -0.9)};
  FitBoxesToChildren(&delta);
  return delta;
}

GraphDelta TableWithCup() {
  GraphDelta delta;
  delta.map = "house";
  delta.session_id = "test";
  delta.sequence = 2;
  delta.labels = {{3, "cup"}, {4, "table"}};
  delta.nodes = {Thing(kTable, 4, "table", 8.0, 0.2), Thing(kCup, 3, "cup", 8.0, 0.6)};
  delta.edges = {MakeEdge(NodeId('p', 8), relations::kContains, kTable),
                 MakeEdge(NodeId('p', 8), relations::kContains, kCup),
                 MakeEdge(kCup, relations::kOn, kTable)};
  return delta;
}

class QuestionsRun : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "dsg-cli-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    const auto store = GraphStore::Open(folder_ + "/store", {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "house";
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter("house");
    ASSERT_TRUE(writer.ok()) << writer.status();
    for (const GraphDelta& delta : {House(), TableWithCup()}) {
      const auto committed = (*writer)->Commit(delta);
      ASSERT_TRUE(committed.ok()) << committed.status();
    }
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome Ask(const Arguments& arguments) const {
    return test::RunDsg(arguments, {.store = folder_ + "/store"});
  }
  Json AskJson(Arguments arguments, int code = 0) const {
    arguments.push_back("--json");
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.errors;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
  void ExpectRefused(int code, const std::string& what, const Arguments& arguments) const {
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.errors;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.errors.find(what), std::string::npos) << outcome.errors;
  }

  std::string folder_;
};

TEST_F(QuestionsRun, FindTakesTheQueryLanguage) {
  const Json reply = AskJson({"find", "cup", "on", "(table", "in", "kitchen)"});
  ASSERT_EQ(reply["hits"].size(), 1u);
  EXPECT_EQ(reply["hits"][0]["node"]["id"], "O2");
  EXPECT_EQ(reply["hits"][0]["related_ids"][0], "O1");
  const Outcome outcome = Ask({"find", "cup on table", "--explain", "--near", "0,0,0"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_NE(outcome.out.find("kitchen (R2)"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("understood as: "), std::string::npos) << outcome.out;
}

TEST_F(QuestionsRun, FindCounts) {
  EXPECT_EQ(AskJson({"find", "cup or table", "--count"})["hit_count"], "2");
  const Outcome outcome = Ask({"find", "cup or table", "--count"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(outcome.out, "2 nodes (revision 2)\n");
}

TEST_F(QuestionsRun, AMistakeInAQueryIsShownWhereItIs) {
  ExpectRefused(2, "QUERY_MALFORMED", {"find", "cup on ("});
  ExpectRefused(2, ">>>", {"find", "cup on ("});
  ExpectRefused(1, "CLASS_UNKNOWN", {"find", "class = unicorn"});
}

TEST_F(QuestionsRun, WordsThatTheMapDoesNotKnowAreNoEmptyList) {
  ExpectRefused(1, "RELATION_UNKNOWN", {"edges", "--relation", "BOGUS"});
  ExpectRefused(1, "CLASS_UNKNOWN", {"ls", "--class", "unicorn"});
  ExpectRefused(1, "\"room\"", {"ls", "--kind", "rooom"});
  ExpectRefused(1, "CLASS_UNKNOWN", {"near", "0,0,0", "--kind", "rooom"});
  ExpectRefused(1, "near in spelling: \"kitchen\"", {"find", "cup in (room \"kitchn\")"});
  // A kind of the model, though none is there.
  EXPECT_EQ(Ask({"ls", "--kind", "structure"}).code, 0);
  // Known, though none is there.
  EXPECT_EQ(Ask({"edges", "--relation", "ON", "--source", "p1"}).code, 0);
}

TEST_F(QuestionsRun, PathGoesFromPointsIdsAndNames) {
  const Json reply = AskJson({"path", "0,0,0", "nearest table"});
  EXPECT_EQ(reply["to_node_id"], "O1");
  EXPECT_NEAR(reply["length_m"].get<double>(), 7.5, 1.0);
  EXPECT_EQ(reply["room_ids"], Json({"R1", "R2"}));
  EXPECT_EQ(AskJson({"path", "p0", "p3", "--flat"})["place_ids"].size(), 4u);
  const Outcome outcome = Ask({"path", "hall", "cup", "--check"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_NE(outcome.out.find("touches"), std::string::npos) << outcome.out;
  ExpectRefused(1, "NO_PATH", {"path", "p0", "p9", "--avoid", "p5"});
  ExpectRefused(1, "NODE_UNKNOWN", {"path", "p0", "attic"});
  ExpectRefused(2, "FROM", {"path", "1,,2", "p0", "--flat"});
  ExpectRefused(2, "NUMBER_NOT_FINITE", {"path", "nan,0,0", "p0"});
  ExpectRefused(2, "FROM", {"path", "1,2", "p0"});
}

TEST_F(QuestionsRun, CollideExitsWithOneWhereTheBodyIsFree) {
  const Json hit = AskJson({"collide", "--sphere", "0.3", "--pose", "8,0,0.6"});
  EXPECT_EQ(hit["results"][0]["hit"], true);
  const Json swept =
      AskJson({"collide", "--box", "0.2,0.2,0.2", "--pose", "0,0,0.3", "9,0,0.3", "--objects"});
  EXPECT_EQ(swept["results"][0]["node_id"], "O1");
  const Json free = AskJson({"collide", "--sphere", "0.1", "--pose", "3,5,1", "--objects"}, 1);
  EXPECT_EQ(free["results"][0]["hit"], false);
  const Outcome outcome = Ask({"collide", "--sphere", "0.1", "--pose", "3,5,1", "--objects"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.errors, "");
  EXPECT_EQ(outcome.out.substr(0, 4), "free");
  ExpectRefused(2, "--pose", {"collide", "--sphere", "0.1", "--pose", "3,nan,1"});
}

TEST_F(QuestionsRun, MetKnowsWhoCameNearWhom) {
  const Json reply = AskJson({"met", "ann", "--within", "1.8"});
  ASSERT_EQ(reply["encounters"].size(), 1u);
  EXPECT_NEAR(std::stod(reply["encounters"][0]["closest_at_ns"].get<std::string>()), 5e9, 1e6);
  EXPECT_NEAR(std::stod(reply["encounters"][0]["from_ns"].get<std::string>()), 4e9, 2e6);
  EXPECT_EQ(AskJson({"met", "--from", "+8s"})["encounters"].size(), 0u);
  ExpectRefused(1, "AGENT_UNKNOWN", {"met", "zoe"});
  ExpectRefused(2, "TIME_RANGE_INVERTED", {"met", "--from", "+2s", "--to", "+1s"});
}

TEST_F(QuestionsRun, ErrorsOfTheServiceNameWhatWasTyped) {
  ExpectRefused(2, "--from +2s is not before --to +1s;", {"met", "--from", "+2s", "--to", "+1s"});
  ExpectRefused(2, "OTHER is ann", {"met", "ann", "ann"});
  ExpectRefused(2, "--horizon is 1", {"predict", "ann", "--horizon", "1ns"});
  ExpectRefused(2, "--box: size.x is 0", {"collide", "--box", "0,1,1", "--pose", "0,0,0"});
  ExpectRefused(2, "--reach is 2; give metres above --margin",
                {"collide", "--sphere", "1", "--pose", "0,0,0", "--margin", "3", "--reach", "2"});
  ExpectRefused(1, "TO: no node of map", {"path", "p0", "attic"});
  ExpectRefused(1, "`dsg ls` and `dsg find`", {"show", "attic"});
  ExpectRefused(1, "`dsg maps` lists", {"stats", "--map", "nope"});
}

TEST_F(QuestionsRun, ARoomWithoutANameIsKnownByItsClass) {
  EXPECT_EQ(AskJson({"who", "--room", "bathroom"})["intervals"].size(), 0u);
  EXPECT_EQ(AskJson({"who", "--room", "bathroom"}), AskJson({"who", "--room", "R3"}));
  // What is no room is no place to be in.
  ExpectRefused(1, "NODE_UNKNOWN", {"who", "--room", "attic"});
  // The building, or the room? Nobody can know.
  ASSERT_EQ(Ask({"set", ToString(kBuilding), "--name", "bathroom"}).code, 0);
  ExpectRefused(2, "is the name of the building", {"who", "--room", "bathroom"});
  EXPECT_EQ(AskJson({"who", "--room", "R3"})["intervals"].size(), 0u);
}

TEST_F(QuestionsRun, NothingPickedIsAnAnswer) {
  const Outcome outcome = Ask({"picked", "ann", "--room", "kitchen"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_NE(outcome.out.find("0 objects"), std::string::npos) << outcome.out;
  ExpectRefused(1, "NODE_UNKNOWN", {"picked", "--room", "attic"});
  ExpectRefused(1, "CLASS_UNKNOWN", {"picked", "--class", "unicorn"});
  ExpectRefused(1, "CLASS_UNKNOWN", {"near", "0,0,0", "--class", "unicorn"});
}

TEST_F(QuestionsRun, PredictGoesOnWhereTheTrackEnds) {
  const Json reply =
      AskJson({"predict", "ann", "--model", "cv", "--horizon", "2s", "--every", "1s"});
  ASSERT_EQ(reply["paths"].size(), 1u);
  ASSERT_EQ(reply["paths"][0]["poses"].size(), 2u);
  EXPECT_NEAR(reply["paths"][0]["poses"][1]["position"]["x"].get<double>(), 10.8, 0.2);
  ExpectRefused(1, "TIME_OUTSIDE_TRACK", {"predict", "ann", "--at", "-5s"});
  ExpectRefused(2, "--horizon", {"predict", "ann", "--horizon", "soon"});
}

TEST_F(QuestionsRun, AroundAndSubgraphFollowEdges) {
  const Json around = AskJson({"around", "cup", "--relation", "ON"});
  ASSERT_EQ(around["neighbors"].size(), 1u);
  EXPECT_EQ(around["neighbors"][0]["node"]["id"], "O1");
  const Json subgraph = AskJson({"subgraph", "R2"});
  EXPECT_EQ(subgraph["nodes"].size(), 8u);
  EXPECT_EQ(AskJson({"subgraph", "R2", "--depth", "1"})["nodes"].size(), 6u);
  EXPECT_EQ(Ask({"subgraph", "R2"}).code, 0);
}

TEST_F(QuestionsRun, DiffListsWhatTheSecondRevisionBrought) {
  const Json reply = AskJson({"diff", "1"});
  EXPECT_EQ(reply["to_revision"], "2");
  int added = 0;
  for (const Json& node : reply["nodes"]) added += node["type"] == "ADDED";
  EXPECT_EQ(added, 2);
  EXPECT_NE(Ask({"diff", "1", "2"}).out.find("O2 ON O1"), std::string::npos);
  EXPECT_EQ(AskJson({"diff", "1", "2", "--limit", "1"})["nodes"].size(), 1u);
  ExpectRefused(1, "REVISION_IN_FUTURE", {"diff", "1", "9"});
}

TEST_F(QuestionsRun, WatchTellsWhatCameSinceARevision) {
  const Outcome outcome = Ask({"watch", "--after", "0", "-n", "2", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  std::istringstream lines(outcome.out);
  std::vector<Json> messages;
  for (std::string line; std::getline(lines, line);) {
    messages.push_back(Json::parse(line, nullptr, /*allow_exceptions=*/false));
  }
  ASSERT_EQ(messages.size(), 2u) << outcome.out;
  EXPECT_EQ(messages[0]["revision"]["revision"], "1");
  EXPECT_EQ(messages[1]["revision"]["revision"], "2");
  const Outcome changes = Ask({"watch", "--after", "1", "-n", "1", "--changes"});
  EXPECT_NE(changes.out.find("O2 ON O1"), std::string::npos) << changes.out;
  ExpectRefused(1, "REVISION_IN_FUTURE", {"watch", "--after", "9"});
}

TEST_F(QuestionsRun, AnswersCanBeDrawn) {
  const std::vector<Arguments> questions = {{"track", "ann"},
                                            {"where", "ann", "--at", "+2.2s"},
                                            {"who", "--room", "hall"},
                                            {"around", "hall"},
                                            {"met"},
                                            {"picked"},
                                            {"find", "cup"},
                                            {"path", "p0", "cup"},
                                            {"predict", "ann", "--floor", "0"},
                                            {"collide", "--sphere", "2", "--pose", "8,0,0.6"}};
  for (const Arguments& question : questions) {
    const std::string file = folder_ + "/" + question[0] + ".png";
    Arguments arguments = question;
    arguments.insert(arguments.end(), {"--png", file, "--width", "400"});
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, 0) << question[0] << ": " << outcome.errors;
    EXPECT_NE(outcome.out.find("wrote " + file + ": 400 columns"), std::string::npos)
        << outcome.out;
    std::ifstream png(file, std::ios::binary);
    std::string magic(4, ' ');
    png.read(magic.data(), 4);
    EXPECT_EQ(magic, "\x89PNG") << question[0];
    ExpectRefused(2, "--force", arguments);
    EXPECT_FALSE(std::filesystem::exists(file + ".part"));
  }
}

// A box instead of a room, and what an answer in JSON has beside it.
TEST_F(QuestionsRun, PicturesAreOfEveryFormOfAQuestion) {
  const std::string file = folder_ + "/a.png";
  for (const Arguments& question : {Arguments{"who", "--box", "0,-1,-1,3,1,2"},
                                    {"around", "cup", "--at", "+1s"},
                                    {"where", "ann", "--at", "+2s", "--json"},
                                    {"track", "ann", "--format", "csv"}}) {
    Arguments arguments = question;
    arguments.insert(arguments.end(), {"--png", file, "--width", "300", "--force"});
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, 0) << question[0] << ": " << outcome.errors;
    EXPECT_TRUE(std::filesystem::remove(file)) << question[0];
  }
}

TEST_F(QuestionsRun, NoQuestionIsAskedWhosePictureCannotBeWritten) {
  const std::string file = folder_ + "/no/picture.png";
  for (const Arguments& question :
       std::vector<Arguments>{{"track", "ann"}, {"met"}, {"find", "cup"}, {"path", "p0", "cup"}}) {
    Arguments arguments = question;
    arguments.insert(arguments.end(), {"--png", file});
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, 2) << question[0];
    EXPECT_EQ(outcome.out, "") << question[0];
    EXPECT_NE(outcome.errors.find(file), std::string::npos) << outcome.errors;
    EXPECT_NE(outcome.errors.find("No such file or directory"), std::string::npos)
        << outcome.errors;
  }
}

TEST_F(QuestionsRun, AnAnswerWithoutItsPictureIsAnError) {
  const std::string file = folder_ + "/attic.png";
  const Outcome plain = Ask({"track", "ann"});
  const Outcome outcome = Ask({"track", "ann", "--png", file, "--floor", "attic"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out, plain.out);
  EXPECT_NE(outcome.errors.find("its picture " + file + " was not written: "), std::string::npos)
      << outcome.errors;
  EXPECT_NE(outcome.errors.find("attic"), std::string::npos) << outcome.errors;
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace dsg::cli
