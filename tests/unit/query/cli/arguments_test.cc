// SPDX-License-Identifier: Apache-2.0
#include "query/cli/arguments.h"

#include <gtest/gtest.h>

#include <any>
#include <sstream>
#include <string>
#include <vector>

#include "query/cli/verbs_agents.h"
#include "query/cli/verbs_graph.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using test::Arguments;
using test::ParseAs;
using test::Refusal;

CommonOptions ParseCommon(const Arguments& arguments, const Environment& environment) {
  const auto command = ParseArguments(arguments, environment);
  EXPECT_TRUE(command.ok()) << command.status();
  return command.ok() ? command->common : CommonOptions();
}

std::string HelpOf(Arguments arguments) {
  arguments.push_back("--help");
  const auto command = ParseArguments(arguments, {});
  EXPECT_TRUE(command.ok()) << command.status();
  return command.ok() ? command->help : "";
}

TEST(Arguments, TakesTimesWithEitherSign) {
  for (const char* time :
       {"+12.5s", "-3s", "-200ms", "1403715524907143168", "-5", "2014-06-25T16:58:44.9Z"}) {
    EXPECT_EQ(ParseAs<WhereVerb>({"where", "H12", "--at", time}).at, time);
    EXPECT_EQ(ParseAs<WhereVerb>({"where", "--at", time, "H12"}).agent, "H12");
    EXPECT_EQ(ParseAs<WhereVerb>({"where", "H12", std::string("--at=") + time}).at, time);
    EXPECT_EQ(ParseAs<TrackVerb>({"track", "H12", "--from", time, "--to", "+9s"}).from, time);
  }
}

TEST(Arguments, TakesPointsAndBoxesThatBeginBelowZero) {
  EXPECT_EQ(ParseAs<NearVerb>({"near", "-1.5,2,3"}).position, "-1.5,2,3");
  EXPECT_EQ(ParseAs<NearVerb>({"near", "--k", "7", "-1,-2,-3"}).k, 7);
  EXPECT_EQ(ParseAs<WhoVerb>({"who", "--box", "-1,-2,-3,1,2,3", "--from", "-1s"}).box,
            "-1,-2,-3,1,2,3");
}

TEST(Arguments, AgentNamesMayBeNumbers) {
  EXPECT_EQ(ParseAs<WhereVerb>({"where", "12", "--at", "0"}).agent, "12");
}

TEST(Arguments, FilterOfListingIsComplete) {
  const ListVerb verb =
      ParseAs<ListVerb>({"ls", "--layer", "rooms", "--kind", "room", "--class", "kitchen",
                         "--parent", "B0", "--name", "n", "--box", "0,0,0,1,1,1", "--at", "+1s"});
  EXPECT_EQ(verb.filter.layer, "rooms");
  EXPECT_EQ(verb.filter.kind, "room");
  EXPECT_EQ(verb.filter.class_name, "kitchen");
  EXPECT_EQ(verb.filter.at, "+1s");
  EXPECT_EQ(verb.parent, "B0");
  EXPECT_EQ(verb.name, "n");
  EXPECT_EQ(verb.box, "0,0,0,1,1,1");
}

TEST(Arguments, CommonOptionsStandBehindTheVerb) {
  const CommonOptions common =
      ParseCommon({"ls", "--server", "unix:s", "--map", "office", "--revision", "17", "--json",
                   "--limit", "5", "--timeout", "2.5"},
                  {});
  EXPECT_EQ(common.server, "unix:s");
  EXPECT_EQ(common.map, "office");
  EXPECT_EQ(common.at.number, 17);
  EXPECT_TRUE(common.json);
  EXPECT_EQ(common.limit, 5);
  EXPECT_EQ(common.timeout_s, 2.5);
}

TEST(Arguments, EnvironmentFillsWhatIsLeftOpen) {
  const CommonOptions common = ParseCommon({"stats"}, {.server = "unix:s", .map = "office"});
  EXPECT_EQ(common.server, "unix:s");
  EXPECT_EQ(common.map, "office");
  EXPECT_FALSE(common.at.is_set());
}

TEST(Arguments, CommandLineWinsOverEnvironment) {
  const Environment both{.store = "env-store", .server = "env-server", .map = "env-map"};
  const CommonOptions store = ParseCommon({"stats", "--store", "s", "--map", "m"}, both);
  EXPECT_EQ(store.store, "s");
  EXPECT_EQ(store.server, "");
  EXPECT_EQ(store.map, "m");
  EXPECT_EQ(ParseCommon({"stats", "--server", "unix:s"}, both).store, "");
}

TEST(Arguments, RefusesTwoPlaces) {
  const std::string message = Refusal({"stats", "--store", "s", "--server", "unix:s"}, {});
  EXPECT_NE(message.find("both a store (s) and a server (unix:s)"), std::string::npos) << message;
  Refusal({"stats"}, {.store = "s", .server = "unix:s"});
}

TEST(Arguments, RefusesNoPlaceSayingWhatToGive) {
  const std::string message = Refusal({"stats"}, {});
  EXPECT_NE(message.find("--store DIR or --server ADDR"), std::string::npos) << message;
}

TEST(Arguments, ImportAndVerifyNeedAStore) {
  const Environment server{.server = "unix:s", .map = "m"};
  EXPECT_NE(Refusal({"import", "f.json"}, server).find("dsg-ingest --server"), std::string::npos);
  EXPECT_NE(Refusal({"verify"}, server).find("--store DIR"), std::string::npos);
  EXPECT_NE(Refusal({"import", "f.json", "--store", "s"}, {}).find("--map NAME"),
            std::string::npos);
  EXPECT_EQ(ParseCommon({"import", "f.json", "--map", "m"}, {.store = "s"}).map, "m");
}

// As an unset variable of a script gives it.
TEST(Arguments, RefusesWhatIsThereAndEmpty) {
  const std::vector<std::vector<std::string>> lines = {
      {"drop", "office", "--yes", "--store", ""},
      {"stats", "--server", ""},
      {"stats", "--map", ""},
      {"tag", "", "--revision", "3"},
      {"path", "carol", "kitchen", "--at", ""},
      {"ls", "--class", ""},
      {"where", "", "--at", "+1s"},
  };
  for (const std::vector<std::string>& line : lines) {
    EXPECT_NE(Refusal(line).find("is empty"), std::string::npos) << line[0];
  }
  // Here it says something.
  EXPECT_TRUE(ParseArguments({"set", "O9", "--name", "", "--store", "s"}, {}).ok());
}

TEST(Arguments, RefusesWhatItDoesNotKnow) {
  Refusal({});
  EXPECT_NE(Refusal({"fly"}).find("no verb \"fly\""), std::string::npos);
  Refusal({"where", "H12"});
  Refusal({"where", "--at", "+1s"});
  Refusal({"where", "H12", "--at", "+1s", "--color", "red"});
  Refusal({"stats", "--revision", "-1"});
  Refusal({"stats", "--revision", ""});
  Refusal({"ls", "--limit", "0"});
  Refusal({"near", "0,0,0", "--k", "1001"});
  Refusal({"near", "0,0,0", "--timeout", "0"});
  // Revisions are what log lists, not what it is asked at.
  Refusal({"log", "--revision", "1"});
}

TEST(Arguments, WhoNeedsExactlyOnePlace) {
  EXPECT_NE(Refusal({"who"}).find("--room ID or --box"), std::string::npos);
  Refusal({"who", "--room", "R1", "--box", "0,0,0,1,1,1"});
  EXPECT_EQ(ParseAs<WhoVerb>({"who", "--room", "big kitchen"}).room, "big kitchen");
}

TEST(Arguments, HelpIsAnAnswer) {
  const std::string all = HelpOf({});
  for (const char* verb : {"where", "track", "who", "ls", "edges", "show", "near", "log", "stats",
                           "maps", "import", "verify", "version"}) {
    EXPECT_NE(all.find(std::string("  ") + verb), std::string::npos) << verb;
  }
  const std::string where = HelpOf({"where"});
  EXPECT_NE(where.find("--at"), std::string::npos) << where;
}

TEST(Arguments, HelpHasEachVerbUnderAHeading) {
  const std::string all = HelpOf({});
  size_t before = 0;
  for (const char* line : {"Ask about people and robots:", "  where ", "Look:", "  map ", "  view ",
                           "Maps and their revisions:", "  log ", "Keep and forget:", "  prune ",
                           "In and out:", "  export ", "This program:", "  completion "}) {
    const size_t at = all.find(std::string("\n") + line, before);
    ASSERT_NE(at, std::string::npos) << line << " in " << all;
    before = at;
  }
  // The heading of verbs that have none.
  EXPECT_EQ(all.find("Subcommands"), std::string::npos);
}

TEST(Arguments, AsOfIsADateBesideRevisionAndTag) {
  EXPECT_EQ(
      ParseCommon({"stats", "--as-of", "1970-01-01T00:00:02Z"}, {.store = "s"}).at.committed_at_ns,
      2 * kNsPerSecond);
  EXPECT_EQ(ParseCommon({"stats", "--as-of", "1970-01-01T02:00:00.5+02:00"}, {.store = "s"})
                .at.committed_at_ns,
            kNsPerSecond / 2);
  for (const char* text : {"+2s", "-2s", "1403715524907143168", "yesterday", "T", ""}) {
    EXPECT_NE(Refusal({"stats", "--as-of", text}).find("is no date; write it in UTC"),
              std::string::npos)
        << text;
  }
  EXPECT_NE(
      Refusal({"stats", "--as-of", "1970-01-01T00:00:02Z", "--revision", "3"}).find("excludes"),
      std::string::npos);
}

// As a shell would: quotes keep words together.
Arguments WordsOf(const std::string& line) {
  Arguments words;
  char quote = 0;
  bool is_open = false;
  for (const char c : line) {
    if (quote != 0 ? c == quote : c == '\'' || c == '"') {
      quote = quote != 0 ? 0 : c;
    } else if (c == ' ' && quote == 0) {
      is_open = false;
    } else {
      if (!is_open) words.emplace_back();
      is_open = true;
      words.back() += c;
    }
  }
  return words;
}

TEST(Arguments, HelpOfEachVerbHasAnExampleThatCanBeTyped) {
  const std::string all = HelpOf({});
  std::istringstream lines(all.substr(all.find("Ask about people and robots:")));
  std::string line;
  int count = 0;
  while (std::getline(lines, line)) {
    // Headings and the notes at the end.
    if (line.substr(0, 2) != "  ") continue;
    const std::string verb = WordsOf(line)[0];
    const std::string help = HelpOf({verb});
    const size_t at = help.find("Example: dsg ");
    ASSERT_NE(at, std::string::npos) << help;
    Arguments words = WordsOf(help.substr(at + 13, help.find('\n', at) - at - 13));
    ASSERT_EQ(words[0], verb);
    const auto command = ParseArguments(words, {.store = "s"});
    EXPECT_TRUE(command.ok()) << command.status();
    ++count;
  }
  EXPECT_GE(count, 26);
}

TEST(Arguments, MistakesNameTheOptionAndWhereHelpIs) {
  EXPECT_EQ(Refusal({"path", "a", "b", "--radius", "-1"}),
            "--radius: \"-1\" is not a number above zero; see dsg path --help");
  EXPECT_EQ(Refusal({"path", "a", "b", "--radius", "nan"}),
            "--radius: \"nan\" is not a number above zero; see dsg path --help");
  EXPECT_EQ(Refusal({"ls", "--limit", "0"}),
            "--limit: \"0\" is not a whole number above zero; see dsg ls --help");
  EXPECT_EQ(Refusal({"near", "1,2,3", "-k", "1001"}),
            "--k: \"1001\" is not a number from 1 to 1000; see dsg near --help");
  EXPECT_EQ(Refusal({"upgrade", "--server", "x"}),
            "not understood: --server x; see dsg upgrade --help");
  EXPECT_NE(Refusal({"where", "carol"}).find("--at is required; see dsg where --help"),
            std::string::npos);
  const std::string no_verb = Refusal({});
  EXPECT_EQ(no_verb.find("name a verb: where, "), 0u) << no_verb;
  EXPECT_NE(no_verb.find("; see dsg --help"), std::string::npos) << no_verb;
}

TEST(Arguments, SaysWhatAMisspeltWordMayHaveMeant) {
  EXPECT_EQ(Refusal({"serch"}), "there is no verb \"serch\"; see dsg --help");
  EXPECT_EQ(Refusal({"wheer", "ada"}),
            "there is no verb \"wheer\"; near in spelling: \"where\"; see dsg --help");
  EXPECT_EQ(Refusal({"ls", "--revison", "3"}),
            "not understood: --revison 3; near in spelling: \"--revision\"; see dsg ls --help");
  // The option that is missing is the one that is misspelt.
  const std::string required = Refusal({"export", "--gtlf=a.glb"});
  EXPECT_NE(required.find("near in spelling: \"--gltf\""), std::string::npos) << required;
  EXPECT_EQ(Refusal({"where", "ada", "--att", "+1s"}),
            "not understood: --att +1s; near in spelling: \"--at\"; see dsg where --help");
}

TEST(Arguments, OptionsStandBehindTheVerb) {
  EXPECT_EQ(Refusal({"--store", "S", "where", "carol"}),
            "options come after the verb: dsg where --store S; see dsg where --help");
  EXPECT_EQ(Refusal({"--store=S", "where", "carol"}),
            "options come after the verb: dsg where --store=S; see dsg where --help");
  EXPECT_EQ(Refusal({"--json"}), "options come after the verb: dsg VERB --json; see dsg --help");
  EXPECT_EQ(Refusal({"--hlep"}).find("not understood: --hlep; near in spelling: \"--help\""), 0u);
  const std::string help = HelpOf({});
  EXPECT_NE(help.find("Usage: dsg VERB [OPTIONS]\n"), std::string::npos) << help;
}

TEST(Arguments, AFileOfAnotherEndingIsRefusedWithItsRightName) {
  EXPECT_EQ(Refusal({"export", "--gltf", "out/office.gltf"}),
            "--gltf: \"out/office.gltf\": only binary glTF is written: name it out/office.glb; "
            "see dsg export --help");
  EXPECT_EQ(Refusal({"map", "--png", "m.jpg"}),
            "--png: \"m.jpg\": only PNG is written: name it m.png; see dsg map --help");
  EXPECT_EQ(Refusal({"export", "--ply", "mesh"}),
            "--ply: \"mesh\": only PLY is written: name it mesh.ply; see dsg export --help");
  EXPECT_EQ(Refusal({"export", "--spark", "a.txt"}),
            "--spark: \"a.txt\": only a Spark-DSG graph is written: end the name in .json, "
            ".sparkdsg, .bin; see dsg export --help");
  EXPECT_NE(Refusal({"export", "--ply", ""}).find("--ply is empty"), std::string::npos);
}

TEST(Arguments, HelpIsAlsoAVerb) {
  EXPECT_EQ(ParseArguments({"help"}, {})->help, HelpOf({}));
  EXPECT_EQ(ParseArguments({"help", "where"}, {})->help, HelpOf({"where"}));
  EXPECT_EQ(Refusal({"prune", "--before", "+1s", ""}, {}),
            "not understood: an empty word; see dsg prune --help");
  EXPECT_EQ(Refusal({"prune", "--dry-run", ""}, {}),
            "not understood: an empty word; see dsg prune --help");
  EXPECT_EQ(Refusal({"ls", "--store=", "--map", "x"}, {}),
            "--store is empty; give a value, or leave it out; see dsg ls --help");
  EXPECT_NE(Refusal({"help", "wheer"}, {}).find("near in spelling: \"where\""), std::string::npos);
  Refusal({"help", "where", "who"}, {});
}

TEST(Arguments, FormatIsOfListsAndNotOfWholeReplies) {
  EXPECT_EQ(ParseCommon({"ls", "--format", "csv"}, {.store = "s"}).format, ListFormat::kCsv);
  EXPECT_EQ(ParseCommon({"ls", "--format", "jsonl"}, {.store = "s"}).format,
            ListFormat::kJsonLines);
  EXPECT_EQ(ParseCommon({"ls"}, {.store = "s"}).format, ListFormat::kTable);
  Refusal({"ls", "--format", "xml"});
  Refusal({"ls", "--format", "csv", "--json"});
  Refusal({"find", "cup", "--count", "--format", "csv"});
  Refusal({"stats", "--format", "csv"});
}

TEST(Arguments, ManualHasEveryVerb) {
  const auto command = ParseArguments({"--man"}, {.version = "0.1.0"});
  ASSERT_TRUE(command.ok()) << command.status();
  EXPECT_EQ(command->help.substr(0, 10), ".TH DSG 1 ");
  for (const char* verb : {"where", "predict", "completion"}) {
    EXPECT_NE(command->help.find(std::string(".SS ") + verb + "\n"), std::string::npos) << verb;
  }
}

TEST(Arguments, VersionNeedsNoPlace) {
  EXPECT_TRUE(ParseArguments({"version"}, {}).ok());
  EXPECT_TRUE(ParseArguments({"--version"}, {}).ok());
}

}  // namespace
}  // namespace dsg::cli
