// SPDX-License-Identifier: Apache-2.0
#include "query/cli/completion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/verb_list.h"
#include "schema/store/graph_store.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using Words = std::vector<std::string>;

Completion After(const Words& words) {
  Grammar grammar("0.1.0");
  AddAllVerbs(&grammar);
  return Complete(grammar.app(), words);
}

bool Has(const Completion& completion, const std::string& word) {
  return std::find(completion.words.begin(), completion.words.end(), word) !=
         completion.words.end();
}

TEST(Completion, BeginsWithTheVerbs) {
  EXPECT_EQ(After({"pre"}).words, (Words{"predict"}));
  EXPECT_TRUE(Has(After({""}), "where"));
  EXPECT_TRUE(Has(After({""}), "help"));
  EXPECT_EQ(After({"help", "pre"}).words, (Words{"predict"}));
  EXPECT_TRUE(After({"fly", ""}).words.empty());
  EXPECT_TRUE(After({}).words.empty());
}

TEST(Completion, OffersTheOptionsOfTheVerbThatAreLeft) {
  EXPECT_EQ(After({"predict", "--ho"}).words, (Words{"--horizon"}));
  const Completion left = After({"predict", "--horizon", "2s", "--"});
  EXPECT_FALSE(Has(left, "--horizon"));
  EXPECT_TRUE(Has(left, "--model"));
  EXPECT_FALSE(Has(left, "--man"));
  // One that may be repeated is offered again.
  EXPECT_TRUE(Has(After({"around", "O1", "--relation", "ON", "--"}), "--relation"));
}

TEST(Completion, KnowsTheWordsOfAnOption) {
  EXPECT_EQ(After({"predict", "--model", ""}).words, (Words{"goals", "cv", "weighted"}));
  EXPECT_EQ(After({"ls", "--format", "c"}).words, (Words{"csv"}));
  EXPECT_EQ(After({"completion", "z"}).words, (Words{"zsh"}));
}

TEST(Completion, KnowsWhatANameIsOf) {
  EXPECT_EQ(After({"where", ""}).kind, WordKind::kAgent);
  EXPECT_EQ(After({"where", "--at", "+1s", ""}).kind, WordKind::kAgent);
  EXPECT_EQ(After({"where", "ada", ""}).kind, WordKind::kNone);
  EXPECT_EQ(After({"met", "ada", ""}).kind, WordKind::kAgent);
  EXPECT_EQ(After({"ls", "--map", ""}).kind, WordKind::kMap);
  EXPECT_EQ(After({"drop", ""}).kind, WordKind::kMap);
  EXPECT_EQ(After({"ls", "--revision", ""}).kind, WordKind::kTag);
  EXPECT_EQ(After({"diff", ""}).kind, WordKind::kTag);
  EXPECT_EQ(After({"who", "--room", ""}).kind, WordKind::kRegion);
  EXPECT_EQ(After({"path", ""}).kind, WordKind::kNode);
  EXPECT_EQ(After({"ls", "--layer", ""}).kind, WordKind::kLayer);
  EXPECT_EQ(After({"ls", "--kind", ""}).kind, WordKind::kKind);
  EXPECT_EQ(After({"subgraph", "O1", "--class", ""}).kind, WordKind::kClass);
  EXPECT_EQ(After({"edges", "--relation", ""}).kind, WordKind::kRelation);
  EXPECT_EQ(After({"around", "O1", "--relation", "ON", "--relation", ""}).kind,
            WordKind::kRelation);
}

TEST(Completion, KnowsWhereAFileMayStand) {
  for (const Words& words :
       {Words{"where", "ada", "--png", ""}, Words{"ls", "--store", ""}, Words{"import", ""},
        Words{"export", "--gltf", ""}, Words{"export", "--csv", ""}, Words{"view", ""},
        Words{"backup", ""}, Words{"restore", ""}}) {
    EXPECT_EQ(After(words).kind, WordKind::kFile) << words[0];
  }
  for (const Words& words : {Words{"ls", "--limit", ""}, Words{"where", "ada", "--at", ""},
                             Words{"ls", "--format", ""}, Words{"ls", "--server", ""}}) {
    EXPECT_EQ(After(words).kind, WordKind::kNone) << words[1];
  }
  EXPECT_TRUE(After({"ls", "--limit", ""}).words.empty());
  // By the exit code shells know whether to offer their own files.
  EXPECT_EQ(test::RunDsg({"completion", "words", "--", "where", "ada", "--png", ""}).code, 1);
  EXPECT_EQ(test::RunDsg({"completion", "words", "--", "ls", "--limit", ""}).code, 0);
  EXPECT_EQ(test::RunDsg({"completion", "words", "--", "ls", "--format", ""}).code, 0);
}

TEST(Completion, WordsOfSearchesAreThoseOfTheMap) {
  const std::string folder = testing::TempDir() + "completion_words";
  std::filesystem::remove_all(folder);
  {
    const auto store = GraphStore::Open(folder, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "office";
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter("office");
    ASSERT_TRUE(writer.ok()) << writer.status();
    GraphDelta delta;
    delta.map = "office";
    delta.session_id = "test";
    delta.sequence = 1;
    delta.nodes = {test::MakeNode(NodeId('R', 1), kinds::kRoom, "hall", 1.0),
                   test::MakeNode(NodeId('p', 1), kinds::kPlace, "", 1.0),
                   test::MakeNode(NodeId('p', 2), kinds::kPlace, "", 2.0)};
    delta.edges = {test::MakeEdge(NodeId('R', 1), relations::kContains, NodeId('p', 1)),
                   test::MakeEdge(NodeId('R', 1), relations::kContains, NodeId('p', 2))};
    FitBoxesToChildren(&delta);
    const auto committed = (*writer)->Commit(delta);
    ASSERT_TRUE(committed.ok()) << committed.status();
  }
  std::ostringstream notes;
  CommonOptions common;
  common.store = folder;
  Session session(common, "0.1.0", &notes);
  ASSERT_TRUE(session.Open().ok());
  ASSERT_TRUE(session.ChooseMap().ok());
  const absl::StatusOr<SearchWords> words = WordsOfSearches(session);
  ASSERT_TRUE(words.ok()) << words.status();
  EXPECT_EQ(words->layers, (Words{"places", "rooms"}));
  EXPECT_EQ(words->kinds, (Words{"place", "room"}));
  EXPECT_EQ(words->classes, Words());
  EXPECT_EQ(words->relations, (Words{"CONTAINS"}));
}

TEST(Completion, ReadsThePlaceFromTheLine) {
  EXPECT_EQ(ValueOf({"ls", "--store", "s", "--map", ""}, "--store"), "s");
  EXPECT_EQ(ValueOf({"ls", "--store=s", ""}, "--store"), "s");
  EXPECT_EQ(ValueOf({"ls", "--store", ""}, "--store"), "");
  EXPECT_EQ(BeginningWith("\"off", {"office 4", "hall", ""}), (Words{"office 4"}));
}

TEST(Completion, EveryShellHasAScriptThatAsksTheProgram) {
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const test::Outcome outcome = test::RunDsg({"completion", shell});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.out.find("completion words --"), std::string::npos) << shell;
  }
  EXPECT_EQ(test::RunDsg({"completion", "csh"}).code, 2);
  EXPECT_EQ(test::RunDsg({"completion", "words", "--", "pre"}).out, "predict\n");
  // A store that is not there is no reason to print anything.
  const test::Outcome outcome =
      test::RunDsg({"completion", "words", "--", "where", "--store", "/nowhere", ""});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out + outcome.errors, "");
}

}  // namespace
}  // namespace dsg::cli
