// SPDX-License-Identifier: Apache-2.0
#include "schema/program/manual.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <sstream>
#include <string>

namespace dsg {
namespace {

bool Holds(const std::string& page, const std::string& text) {
  return page.find(text) != std::string::npos;
}

TEST(Manual, HasProgramOptionsByGroupAndNotes) {
  CLI::App app("dsg-thing: does a thing.", "dsg-thing");
  std::string store;
  std::string log;
  double rate = 2.5;
  app.add_option("LOG", log, "The log")->required();
  app.add_option("--store", store, "Folder of the store")->required();
  app.add_option("--rate", rate, "Per second")->capture_default_str()->group("Tuning: thing");
  bool is_secret = false;
  app.add_flag("--secret", is_secret, "Not told")->group("");
  app.footer("Exit codes: 0 done.\nSee the docs.");
  const std::string page = ManualPage(app, "1.2.3", "2026-11-21");
  EXPECT_EQ(page.substr(0, page.find('\n')), ".TH DSG-THING 1 2026-11-21 \"dsgdb 1.2.3\"");
  EXPECT_TRUE(Holds(page, ".SH NAME\ndsg\\-thing \\- does a thing\n")) << page;
  EXPECT_TRUE(Holds(page, "[\\fIOPTION\\fR]... \\fILOG\\fR\n")) << page;
  EXPECT_TRUE(Holds(page, "\\fB\\-\\-store\\fR \\fITEXT\\fR\nFolder of the store (required)\n"));
  EXPECT_TRUE(Holds(page, ".SS Tuning: thing\n.TP\n\\fB\\-\\-rate\\fR")) << page;
  EXPECT_TRUE(Holds(page, "Per second (default 2.5)\n")) << page;
  EXPECT_TRUE(Holds(page, ".SH NOTES\nExit codes: 0 done.\n.br\nSee the docs.\n")) << page;
  EXPECT_FALSE(Holds(page, "secret"));
}

TEST(Manual, HasAVerbWithItsOptionsAndNotes) {
  CLI::App app("Asks.", "dsg");
  CLI::App* verb = app.add_subcommand("where", "Where an agent was");
  std::string at;
  verb->add_option("--at", at, "TIME asked about");
  verb->footer("Example: dsg where ada");
  const std::string page = ManualPage(app, "1", "2026-11-21");
  EXPECT_TRUE(Holds(page, ".B dsg\n\\fIVERB\\fR [\\fIOPTION\\fR]... [\\fIARGUMENT\\fR]...\n"));
  EXPECT_TRUE(Holds(page, ".SS where\nWhere an agent was.\n.TP\n\\fB\\-\\-at\\fR")) << page;
  EXPECT_TRUE(Holds(page, ".PP\nExample: dsg where ada\n")) << page;
}

TEST(Manual, VerbsStandUnderTheHeadingsOfTheirGroups) {
  CLI::App app("Asks.", "dsg");
  app.add_subcommand("where", "Where an agent was")->group("Ask");
  app.add_subcommand("who", "Who was there")->group("Ask");
  app.add_subcommand("drop", "Remove a map")->group("Keep");
  app.add_subcommand("secret", "Not told")->group("");
  const std::string page = ManualPage(app, "1", "2026-11-21");
  EXPECT_TRUE(Holds(page, ".SH ASK\n.SS where\nWhere an agent was.\n.SS who\n")) << page;
  EXPECT_TRUE(Holds(page, ".SH KEEP\n.SS drop\n")) << page;
  EXPECT_FALSE(Holds(page, "VERBS"));
  EXPECT_FALSE(Holds(page, "secret"));
}

TEST(Manual, TextIsNeverARequest) {
  CLI::App app("Does.", "dsg");
  bool is_set = false;
  app.add_flag("--dot", is_set, ".SH is text, 'as is this, and a back\\slash");
  const std::string page = ManualPage(app, "1", "2026-11-21");
  EXPECT_TRUE(Holds(page, "\n\\&.SH is text, 'as is this, and a back\\eslash\n")) << page;
}

TEST(Manual, IsAskedForBeforeWhatIsRequired) {
  CLI::App app("Does.", "dsg-thing");
  std::string store;
  app.add_option("--store", store, "Folder")->required();
  AddManual(&app, "1");
  EXPECT_EQ(app.help().find(kManualFlag), std::string::npos);
  setenv("SOURCE_DATE_EPOCH", "1403715524", 1);
  std::ostringstream out;
  std::ostringstream errors;
  try {
    app.parse(std::string(kManualFlag));
    ADD_FAILURE() << "the command line was taken";
  } catch (const CLI::ParseError& error) {
    EXPECT_EQ(app.exit(error, out, errors), 0);
  }
  unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_EQ(out.str(), ManualPage(app, "1", "2014-06-25"));
  EXPECT_EQ(errors.str(), "");
}

}  // namespace
}  // namespace dsg
