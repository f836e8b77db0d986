// SPDX-License-Identifier: Apache-2.0
// prune as scripts see it.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "query/cli/run.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using Json = nlohmann::json;
using test::Arguments;
using test::MakeNode;
using test::Outcome;

class PruneVerbTest : public testing::Test {
 protected:
  // A room with two things; another thing elsewhere.
  void SetUp() override {
    // Nobody is there to be asked, whoever runs the tests.
    ASSERT_NE(std::freopen("/dev/null", "r", stdin), nullptr);
    const auto store = GraphStore::Open(store_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "office";
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    GraphDelta delta;
    delta.session_id = "test";
    delta.sequence = 1;
    delta.nodes = {MakeNode(NodeId('R', 1), kinds::kRoom, "kitchen", 0.0),
                   MakeNode(NodeId('O', 1), kinds::kObject, "cup", 0.0),
                   MakeNode(NodeId('O', 2), kinds::kObject, "pan", 0.0),
                   MakeNode(NodeId('O', 3), kinds::kObject, "bed", 0.0)};
    for (uint64_t i = 1; i <= 2; ++i) {
      delta.edges.push_back(
          {NodeId('R', 1), relations::kContains, NodeId('O', i), 1.0, Interval(), {}, 0});
    }
    const auto writer = (*store)->OpenWriter("office");
    const auto committed = (*writer)->Commit(delta);
    ASSERT_TRUE(committed.ok()) << committed.status();
  }

  Outcome Dsg(Arguments arguments) {
    for (const char* more : {"--store", store_.path().c_str(), "--map", "office"}) {
      arguments.emplace_back(more);
    }
    return test::RunDsg(arguments, {});
  }

  test::TempFolder store_;
};

TEST_F(PruneVerbTest, SaysWhatWouldGoThenWhatWent) {
  const Outcome dry = Dsg({"prune", "--branch", "kitchen", "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.errors;
  EXPECT_NE(dry.out.find("branch kitchen      3"), std::string::npos) << dry.out;
  EXPECT_NE(dry.out.find("nothing was changed"), std::string::npos);
  const Outcome done = Dsg({"prune", "--branch", "kitchen", "--json"});
  EXPECT_EQ(done.code, 0) << done.errors;
  const Json reply = Json::parse(done.out);
  EXPECT_EQ(reply["policies"][0]["matched"]["node_count"], "3");
  EXPECT_EQ(reply["map_before"]["node_count"], "4");
  EXPECT_EQ(reply["map_after"]["node_count"], "1");
  EXPECT_EQ(reply["revision"], "2");
  EXPECT_EQ(reply["done"], true);
  const Json left = Json::parse(Dsg({"ls", "--json"}).out);
  ASSERT_EQ(left["nodes"].size(), 1u);
  EXPECT_EQ(left["nodes"][0]["id"], "O3");
}

TEST_F(PruneVerbTest, RefusesToForgetEverythingOfAScriptWithoutYes) {
  const Outcome refused = Dsg({"prune", "--region", "-9,-9,-9,9,9,9"});
  EXPECT_NE(refused.code, 0);
  EXPECT_NE(refused.errors.find("--yes"), std::string::npos) << refused.errors;
  EXPECT_NE(refused.errors.find("POLICY_MATCHES_ALL"), std::string::npos);
  EXPECT_EQ(Json::parse(Dsg({"ls", "--json"}).out)["nodes"].size(), 4u);
  const Outcome done = Dsg({"prune", "--region", "-9,-9,-9,9,9,9", "--yes"});
  EXPECT_EQ(done.code, 0) << done.errors;
  EXPECT_EQ(Json::parse(Dsg({"ls", "--json"}).out)["nodes"].size(), 0u);
}

TEST_F(PruneVerbTest, RefusesMoreThanTheShareAndADryRunSaysSo) {
  const std::vector<std::string> kitchen = {"prune", "--branch", "kitchen", "--share-max"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), kitchen.begin(), kitchen.end());
    return Dsg(more);
  };
  const Outcome dry = with({"0.5", "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.errors;
  EXPECT_NE(dry.out.find("the run would be refused: "), std::string::npos) << dry.out;
  const Outcome refused = with({"0.5"});
  EXPECT_NE(refused.code, 0);
  EXPECT_NE(refused.errors.find("POLICY_TAKES_TOO_MUCH"), std::string::npos) << refused.errors;
  EXPECT_NE(refused.errors.find("0.75"), std::string::npos) << refused.errors;
  for (const char* wrong : {"-1", "0", "1.5", "nan"}) EXPECT_EQ(with({wrong}).code, 2) << wrong;
  EXPECT_EQ(with({"0.75"}).code, 0);
}

TEST_F(PruneVerbTest, AFileOfPoliciesMaySayWhichShareMayGo) {
  const std::string path = store_.path() + ".yaml";
  std::ofstream(path) << "share_max: 0.5\npolicies:\n  - {name: kitchen, branch: R1}\n";
  const Outcome refused = Dsg({"prune", "--policy", path});
  EXPECT_NE(refused.errors.find("POLICY_TAKES_TOO_MUCH"), std::string::npos) << refused.errors;
  EXPECT_EQ(Dsg({"prune", "--policy", path, "--share-max", "0.8"}).code, 0);
}

TEST_F(PruneVerbTest, TakesAFileOfPolicies) {
  const std::string path = store_.path() + ".yaml";
  std::ofstream(path) << "policies:\n  - {name: quiet kitchen, branch: R1, strength: erase}\n";
  const Outcome done = Dsg({"prune", "--policy", path});
  EXPECT_EQ(done.code, 0) << done.errors;
  EXPECT_NE(done.out.find("quiet kitchen"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("erased:"), std::string::npos) << done.out;
  // Another policy of the same file may have retired only.
  EXPECT_NE(done.out.find("older revisions still have what was only retired"), std::string::npos)
      << done.out;
  std::ofstream(path) << "policies:\n  - {name: a, brunch: R1}\n";
  const Outcome wrong = Dsg({"prune", "--policy", path});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.errors.find(path + ":2:"), std::string::npos) << wrong.errors;
}

TEST_F(PruneVerbTest, TellsDatabaseFromLogAndWhatGivesTheBytesBack) {
  const Outcome retired = Dsg({"prune", "--branch", "kitchen"});
  EXPECT_NE(retired.out.find("database: "), std::string::npos) << retired.out;
  EXPECT_NE(retired.out.find("log, used again: "), std::string::npos) << retired.out;
  EXPECT_NE(retired.out.find("dsg compact"), std::string::npos) << retired.out;
  const Outcome erased = Dsg({"prune", "--branch", "bed", "--erase", "--yes"});
  EXPECT_EQ(erased.out.find("dsg compact"), std::string::npos) << erased.out;
}

TEST_F(PruneVerbTest, DropsHistory) {
  ASSERT_EQ(Dsg({"prune", "--branch", "kitchen"}).code, 0);
  const Outcome kept = Dsg({"prune", "--history-older-than", "30d"});
  EXPECT_EQ(kept.code, 0) << kept.errors;
  EXPECT_EQ(Dsg({"ls", "--revision", "1"}).code, 0);
  const Outcome dropped = Dsg({"prune", "--history-before", "2"});
  EXPECT_EQ(dropped.code, 0) << dropped.errors;
  EXPECT_NE(dropped.out.find("history before revision 2"), std::string::npos) << dropped.out;
  EXPECT_EQ(dropped.out.find("dsg compact"), std::string::npos) << dropped.out;
  EXPECT_NE(Dsg({"ls", "--revision", "1"}).code, 0);
}

TEST_F(PruneVerbTest, SaysBoundsThatPeopleCanRead) {
  const Outcome wrong = Dsg({"prune", "--simplify", "-1"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.errors.find("\"-1\" is not a number above zero"), std::string::npos)
      << wrong.errors;
}

TEST_F(PruneVerbTest, RefusesCommandLinesThatSayTooLittleOrTooMuch) {
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"prune"},
                                             {"prune", "--branch", "R1", "--layer", "mesh"},
                                             {"prune", "--branch", "R1", "--retire", "--erase"},
                                             {"prune", "--policy", "p.yaml", "--erase"},
                                             {"prune", "--branch", "R1", "--simplify", "0.1"},
                                             {"prune", "--simplify", "-1"},
                                             {"prune", "--older-than", "30"},
                                             {"prune", "--history-before", "-1"},
                                             {"prune", "--history-before", "2", "--only", "mesh"},
                                             {"prune", "--region", "1,1,1,0,0,0"},
                                             {"prune", "--before", "yesterday"}}) {
    const Outcome outcome = Dsg(wrong);
    EXPECT_EQ(outcome.code, 2) << outcome.errors;
    EXPECT_FALSE(outcome.errors.empty());
  }
  EXPECT_EQ(Dsg({"prune", "--branch", "R77"}).code, 1);
  EXPECT_EQ(Dsg({"prune", "--policy", "/nowhere.yaml"}).code, 1);
}

}  // namespace
}  // namespace dsg::cli
