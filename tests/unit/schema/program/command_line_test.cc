// SPDX-License-Identifier: Apache-2.0
#include "schema/program/command_line.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

namespace dsg {
namespace {

using Words = std::vector<std::string>;

// What is said of the words; empty if they are taken.
std::string Refusal(CLI::App* app, Words words) {
  std::reverse(words.begin(), words.end());
  try {
    app->parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return UsageMessage(*app, error);
  }
  return "";
}

// A program without verbs.
std::string RefusalOfServer(const Words& words) {
  CLI::App app("Serves.", "dsg-server");
  std::string store;
  std::string listen;
  app.add_option("--store", store, "Folder")->required();
  app.add_option("--listen", listen, "Address");
  bool is_hidden = false;
  app.add_flag("--hidden", is_hidden, "Not told")->group("");
  return Refusal(&app, words);
}

// A program with verbs.
std::string RefusalOfSimulator(const Words& words) {
  CLI::App app("Simulates.", "dsg-simulate");
  app.require_subcommand(1);
  app.set_version_flag("--version", "1");
  std::string out;
  std::string folder;
  CLI::App* tracks = app.add_subcommand("tracks", "People");
  tracks->add_option("--out", out, "Folder")->required();
  app.add_subcommand("preview", "Pictures")->add_option("FOLDER", folder, "Log")->required();
  return Refusal(&app, words);
}

TEST(CommandLine, WordsCannotControlTheTerminalNorFillIt) {
  EXPECT_EQ(RefusalOfServer({"--store", "s", "x\x1b[31m\n\u202ey"}),
            "not understood: x?[31m?\\u202ey; see dsg-server --help");
  EXPECT_EQ(RefusalOfServer({"--store", "s", std::string(100'000, 'x')}),
            "not understood: " + std::string(1000 - 16, 'x') + "...; see dsg-server --help");
}

TEST(CommandLine, WordsThatNobodyKnowsStandInTheirOrderWithWhatIsNear) {
  EXPECT_EQ(RefusalOfServer({"--store", "s", "--lisen", "unix:x.sock"}),
            "not understood: --lisen unix:x.sock; near in spelling: \"--listen\"; "
            "see dsg-server --help");
  EXPECT_EQ(RefusalOfServer({"--store", "s", "--lisen=x"}),
            "not understood: --lisen=x; near in spelling: \"--listen\"; see dsg-server --help");
  EXPECT_EQ(RefusalOfServer({"--store", "s", "x"}), "not understood: x; see dsg-server --help");
  // What no help shows is not offered.
  EXPECT_EQ(RefusalOfServer({"--store", "s", "--hiden"}),
            "not understood: --hiden; see dsg-server --help");
  EXPECT_EQ(RefusalOfServer({"--store", "s"}), "");
}

TEST(CommandLine, AMisspeltOptionIsToldBeforeTheOneThatIsMissing) {
  EXPECT_EQ(RefusalOfServer({"--stroe", "x"}),
            "not understood: --stroe x; near in spelling: \"--store\"; see dsg-server --help");
  EXPECT_EQ(RefusalOfServer({}), "--store is required; see dsg-server --help");
}

TEST(CommandLine, AVerbIsAskedForOrWhatIsNearToIt) {
  EXPECT_EQ(RefusalOfSimulator({}), "name a verb: tracks, preview; see dsg-simulate --help");
  EXPECT_EQ(RefusalOfSimulator({"track"}),
            "there is no verb \"track\"; near in spelling: \"tracks\"; see dsg-simulate --help");
  EXPECT_EQ(RefusalOfSimulator({"fly", "preview"}),
            "there is no verb \"fly\"; see dsg-simulate --help");
  EXPECT_EQ(RefusalOfSimulator({"tracks", "--oot", "x"}),
            "not understood: --oot x; near in spelling: \"--out\"; see dsg-simulate tracks --help");
  EXPECT_EQ(RefusalOfSimulator({"preview"}), "FOLDER is required; see dsg-simulate preview --help");
}

TEST(CommandLine, OptionsComeAfterTheVerb) {
  EXPECT_EQ(RefusalOfSimulator({"--out", "x", "tracks"}),
            "options come after the verb: dsg-simulate tracks --out x; "
            "see dsg-simulate tracks --help");
  EXPECT_EQ(RefusalOfSimulator({"--out=x"}),
            "options come after the verb: dsg-simulate VERB --out=x; see dsg-simulate --help");
  EXPECT_EQ(RefusalOfSimulator({"--verison"}),
            "not understood: --verison; near in spelling: \"--version\"; see dsg-simulate --help");
}

TEST(CommandLine, UsageOfAProgramWithVerbsNamesTheVerbFirst) {
  CLI::App app("Simulates.", "dsg-simulate");
  UseVerbUsage(&app);
  CLI::App* verb = app.add_subcommand("tracks", "People");
  EXPECT_NE(app.help().find("Usage: dsg-simulate VERB [OPTIONS]\n"), std::string::npos)
      << app.help();
  EXPECT_NE(verb->help("dsg-simulate").find("Usage: dsg-simulate tracks [OPTIONS]"),
            std::string::npos)
      << verb->help("dsg-simulate");
}

// Runs a program of one flag and one check with these words behind its name.
int RunThing(Words words, const absl::Status& status, int* run_count) {
  CLI::App app("Does a thing.", "dsg-thing");
  bool is_set = false;
  app.add_flag("--set", is_set, "Set it");
  app.callback([&] {
    if (is_set) throw CLI::ValidationError("--set", "says nothing; leave it out");
  });
  words.insert(words.begin(), "dsg-thing");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  return RunProgram(static_cast<int>(arguments.size()), arguments.data(), &app, [&] {
    ++*run_count;
    return status;
  });
}

TEST(CommandLine, AProgramRunsUnlessItsCommandLineIsRefusedAndTellsItsError) {
  int run_count = 0;
  testing::internal::CaptureStderr();
  EXPECT_EQ(RunThing({}, absl::OkStatus(), &run_count), 0);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  testing::internal::CaptureStderr();
  EXPECT_EQ(RunThing({}, absl::NotFoundError("no such thing"), &run_count), 1);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "dsg-thing: NOT_FOUND: no such thing\n");
  EXPECT_EQ(run_count, 2);
  testing::internal::CaptureStderr();
  EXPECT_EQ(RunThing({"--st"}, absl::OkStatus(), &run_count), 2);
  EXPECT_EQ(RunThing({"--set"}, absl::OkStatus(), &run_count), 2);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "dsg-thing: not understood: --st; near in spelling: \"--set\"; see dsg-thing --help\n"
            "dsg-thing: --set: says nothing; leave it out; see dsg-thing --help\n");
  testing::internal::CaptureStdout();
  EXPECT_EQ(RunThing({"--help"}, absl::OkStatus(), &run_count), 0);
  EXPECT_NE(testing::internal::GetCapturedStdout().find("Set it"), std::string::npos);
  EXPECT_EQ(run_count, 2);
}

}  // namespace
}  // namespace dsg
