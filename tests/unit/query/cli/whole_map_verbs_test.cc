// SPDX-License-Identifier: Apache-2.0
// drop, rename and set, as scripts see them.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "query/cli/run.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::MakeNode;
using test::Outcome;
using test::RunDsg;

class WholeMapVerbs : public testing::Test {
 protected:
  void SetUp() override {
    // No terminal, whoever runs the tests.
    ASSERT_NE(std::freopen("/dev/null", "r", stdin), nullptr);
    for (const char* map : {"office", "attic"}) {
      MapSpec spec;
      spec.name = map;
      const auto store = Open();
      ASSERT_TRUE(store->CreateMap(spec).ok());
    }
    Node room = MakeNode(NodeId('R', 1), kinds::kRoom, "", 0);
    Node chair = MakeNode(NodeId('O', 1), kinds::kObject, "", 1);
    chair.class_id = 7;
    chair.class_name = "chair";
    Node thing = MakeNode(NodeId('O', 2), kinds::kObject, "old name", 2);
    thing.class_id = 0;
    thing.class_name = "thing";
    thing.confidence = 0.5;
    const Node ann = MakeNode(NodeId('H', 1), kinds::kHuman, "ann", 3);
    Commit({room, chair, thing, ann});
  }

  std::unique_ptr<GraphStore> Open() {
    auto store = GraphStore::Open(store_, {.create = true});
    EXPECT_TRUE(store.ok()) << store.status();
    return *std::move(store);
  }
  void Commit(std::vector<Node> nodes) {
    GraphDelta delta;
    delta.map = "office";
    delta.session_id = "test";
    delta.sequence = ++sequence_;
    delta.nodes = std::move(nodes);
    const auto store = Open();
    const auto committed = (*store->OpenWriter("office"))->Commit(std::move(delta));
    ASSERT_TRUE(committed.ok()) << committed.status();
  }
  std::vector<std::string> Maps() { return *Open()->MapNames(); }
  Outcome Ask(Arguments arguments) {
    arguments.insert(arguments.end(), {"--store", store_});
    return RunDsg(arguments);
  }
  Outcome Set(Arguments arguments) {
    arguments.insert(arguments.begin(), "set");
    arguments.insert(arguments.end(), {"--map", "office"});
    return Ask(std::move(arguments));
  }
  void ExpectRefused(int code, const std::string& what, const Outcome& outcome) {
    EXPECT_EQ(outcome.code, code) << outcome.errors;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.errors.find(what), std::string::npos) << outcome.errors;
  }
  Json Show(const std::string& id) {
    const Outcome outcome = Ask({"show", id, "--map", "office", "--json"});
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    return Json::parse(outcome.out)["node"];
  }
  Revision Head() { return (*Open()->OpenMap("office"))->Head()->revision; }

  test::TempFolder folder_;
  const std::string store_ = folder_.path() + "/store";
  int64_t sequence_ = 0;
};

TEST_F(WholeMapVerbs, DropAsksAndAScriptSaysYes) {
  ExpectRefused(2, "refused without --yes: this drops map office: 1 revision, 4 nodes",
                Ask({"drop", "office"}));
  EXPECT_EQ(Maps(), (std::vector<std::string>{"attic", "office"}));
  const Outcome dropped = Ask({"drop", "office", "--yes"});
  EXPECT_EQ(dropped.code, 0) << dropped.errors;
  EXPECT_EQ(dropped.out.find("map office is dropped, with 1 revision; "), 0U) << dropped.out;
  EXPECT_EQ(Maps(), std::vector<std::string>{"attic"});
  ExpectRefused(1, "MAP_UNKNOWN", Ask({"drop", "office", "--yes"}));
  ExpectRefused(1, "MAP_UNKNOWN", Ask({"drop", "office"}));
  const Json json = Json::parse(Ask({"drop", "attic", "--yes", "--json"}).out);
  EXPECT_EQ(json["head_revision"], "0");
}

TEST_F(WholeMapVerbs, NamesThatNoMapHasAreRefusedBeforeAnythingIsOpened) {
  ExpectRefused(2, "is not allowed", Ask({"drop", "\xff", "--yes"}));
  ExpectRefused(2, "is not allowed", Ask({"rename", "office", "\xff"}));
  ExpectRefused(2, "is not allowed", Ask({"rename", "\xff", "office"}));
}

TEST_F(WholeMapVerbs, SetTakesOneLineOfText) {
  ExpectRefused(2, "--name is not UTF-8", Set({"R1", "--name", "\xff"}));
  ExpectRefused(2, "--name has a line break", Set({"R1", "--name", "kit\nchen"}));
  ExpectRefused(2, "--class has 100000 bytes", Set({"O1", "--class", std::string(100'000, 'a')}));
  ExpectRefused(2, "form of an id", Set({"R1", "--name", "O9"}));
  ExpectRefused(2, "is an agent", Set({"H1", "--class", "chair"}));
  EXPECT_EQ(Head(), 1);
}

TEST_F(WholeMapVerbs, SetAnswersWithTheWholeNodeAndSaysWhoElseHasTheName) {
  const Outcome outcome = Set({"O1", "--name", "old name", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["node"], Show("O1"));
  EXPECT_EQ(json["node"]["name"], "old name");
  EXPECT_NE(outcome.errors.find("O2 has the name \"old name\" too"), std::string::npos);
}

TEST_F(WholeMapVerbs, AMapThatCannotBeOpenedIsNotPassedOver) {
  std::ofstream(store_ + "/attic/graph.db", std::ios::binary) << "once a database";
  ExpectRefused(2, "2 maps; name one with --map: attic office", Ask({"stats"}));
  ASSERT_EQ(Ask({"drop", "office", "--yes"}).code, 0);
  // Of the only map it is told what it has, and not that there is none.
  const Outcome outcome = Ask({"stats"});
  EXPECT_EQ(outcome.code, Ask({"stats", "--map", "attic"}).code);
  EXPECT_EQ(outcome.errors, Ask({"stats", "--map", "attic"}).errors);
  EXPECT_EQ(outcome.errors.find("no maps yet"), std::string::npos) << outcome.errors;
}

TEST_F(WholeMapVerbs, DropIsOfTheRevisionThatIsExpected) {
  ExpectRefused(3, "PARENT_REVISION_STALE", Ask({"drop", "office", "--yes", "--expect", "0"}));
  EXPECT_EQ(Ask({"drop", "office", "--yes", "--expect", "-1"}).code, 2);
  EXPECT_EQ(Head(), 1);
  EXPECT_EQ(Ask({"drop", "office", "--yes", "--expect", "1"}).code, 0);
}

TEST_F(WholeMapVerbs, DropNeedsAName) {
  EXPECT_EQ(Ask({"drop", "--yes"}).code, 2);
  ExpectRefused(2, "MAP_NAME_INVALID", Ask({"drop", "../store", "--yes"}));
  ExpectRefused(2, "MAP_NAME_INVALID", Ask({"drop", "../store"}));
  EXPECT_EQ(Maps().size(), 2U);
}

TEST_F(WholeMapVerbs, DropRemovesAMapThatCannotBeRead) {
  fs::resize_file(store_ + "/office/graph.db", 4096);
  ExpectRefused(2, "which cannot be read", Ask({"drop", "office"}));
  const Outcome dropped = Ask({"drop", "office", "--yes"});
  EXPECT_EQ(dropped.code, 0) << dropped.errors;
  EXPECT_FALSE(fs::exists(store_ + "/office"));
}

TEST_F(WholeMapVerbs, RenameSaysWhatItDid) {
  EXPECT_EQ(Ask({"rename", "office", "wing"}).out, "map office is now wing\n");
  EXPECT_EQ(Maps(), (std::vector<std::string>{"attic", "wing"}));
  EXPECT_EQ(Ask({"show", "O1", "--map", "wing"}).code, 0);
  ExpectRefused(2, "MAP_EXISTS", Ask({"rename", "wing", "attic"}));
  ExpectRefused(1, "MAP_UNKNOWN", Ask({"rename", "office", "lab"}));
  ExpectRefused(2, "MAP_NAME_INVALID", Ask({"rename", "wing", "a/b"}));
  EXPECT_EQ(Json::parse(Ask({"rename", "wing", "lab", "--json"}).out)["map"]["name"], "lab");
}

TEST_F(WholeMapVerbs, SetNamesARoom) {
  EXPECT_EQ(Set({"R1", "--name", "kitchen"}).out, "R1: name - -> kitchen (revision 2)\n");
  EXPECT_EQ(Show("R1")["name"], "kitchen");
  // By its name now, and back.
  EXPECT_EQ(Set({"kitchen", "--name", ""}).out, "R1: name kitchen -> - (revision 3)\n");
  const Outcome log = Ask({"log", "--map", "office"});
  EXPECT_NE(log.out.find("dsg set"), std::string::npos) << log.out;
  EXPECT_NE(log.out.find("kitchen"), std::string::npos) << log.out;
}

TEST_F(WholeMapVerbs, SetCorrectsAClassAndLeavesTheRest) {
  const Json before = Show("O2");
  EXPECT_EQ(Set({"O2", "--class", "chair", "--name", "my chair"}).out,
            "O2: name old name -> my chair, class thing -> chair (revision 2)\n");
  Json after = Show("O2");
  EXPECT_EQ(after["semantic_class"]["name"], "chair");
  // As the other chair has it.
  EXPECT_EQ(after["semantic_class"]["id"], 7);
  EXPECT_EQ(after["name"], "my chair");
  for (const char* field : {"semantic_class", "name", "revision"}) after[field] = before[field];
  EXPECT_EQ(after, before);
  EXPECT_EQ(Set({"O2", "--class", "stool"}).code, 0);
  EXPECT_EQ(Show("O2")["semantic_class"]["name"], "stool");
  EXPECT_EQ(Ask({"ls", "--class", "stool", "--map", "office"}).code, 0);
}

TEST_F(WholeMapVerbs, SetOfWhatIsSoAlreadyWritesNothing) {
  const Outcome same = Set({"O2", "--name", "old name", "--class", "thing"});
  EXPECT_EQ(same.code, 0) << same.errors;
  EXPECT_EQ(same.out, "O2 is so already; nothing written (revision 1)\n");
  EXPECT_EQ(Head(), 1);
}

TEST_F(WholeMapVerbs, SetRefusesWhatCannotBe) {
  ExpectRefused(2, "--name or --class", Set({"O2"}));
  ExpectRefused(1, "NODE_UNKNOWN", Set({"O9", "--name", "ghost"}));
  ExpectRefused(2, "is an agent", Set({"H1", "--name", "bob"}));
  EXPECT_EQ(Set({"O2", "--name", std::string(100'000, 'x')}).code, 2);
  EXPECT_EQ(Head(), 1);
}

}  // namespace
}  // namespace dsg::cli
