// SPDX-License-Identifier: Apache-2.0
#include "query/cli/completion.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "query/cli/verb_list.h"
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
  // Files and numbers are the shell's.
  EXPECT_EQ(After({"where", "ada", "--png", ""}).kind, WordKind::kNone);
  EXPECT_TRUE(After({"ls", "--limit", ""}).words.empty());
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
