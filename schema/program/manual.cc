// SPDX-License-Identifier: Apache-2.0
#include "schema/program/manual.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "schema/base/time.h"

namespace dsg {
namespace {

// Text that roff takes as it is, in lines of a terminal's width.
std::string Text(std::string_view plain) {
  constexpr size_t kWidth = 78;
  const std::string escaped =
      absl::StrReplaceAll(std::string(plain), {{"\\", "\\e"}, {"-", "\\-"}, {"\t", " "}});
  std::string text;
  std::string line;
  const auto end_line = [&] {
    // A line that begins with one of these would be a request.
    const bool is_request = line[0] == '.' || line[0] == '\'';
    absl::StrAppend(&text, is_request ? "\\&" : "", line, "\n");
    line.clear();
  };
  for (const absl::string_view word :
       absl::StrSplit(escaped, absl::ByAnyChar(" \n"), absl::SkipEmpty())) {
    if (!line.empty() && line.size() + 1 + word.size() > kWidth) end_line();
    absl::StrAppend(&line, line.empty() ? "" : " ", word);
  }
  if (!line.empty()) end_line();
  return text;
}

// Lines that stay as they are broken.
std::string Paragraphs(const std::string& plain) {
  std::string text;
  for (const absl::string_view line : absl::StrSplit(plain, '\n', absl::SkipWhitespace())) {
    absl::StrAppend(&text, text.empty() ? "" : ".br\n", Text(std::string(line)));
  }
  return text;
}

// "\fB\-\-map\fR \fITEXT\fR".
std::string OptionHead(const CLI::Option& option) {
  const auto bold = [](const std::string& word) {
    return absl::StrCat("\\fB", absl::StrReplaceAll(word, {{"-", "\\-"}}), "\\fR");
  };
  std::string head;
  if (option.get_positional()) head = bold(option.get_name(true));
  for (const std::string& name : option.get_snames()) {
    absl::StrAppend(&head, head.empty() ? "" : ", ", bold("-" + name));
  }
  for (const std::string& name : option.get_lnames()) {
    absl::StrAppend(&head, head.empty() ? "" : ", ", bold("--" + name));
  }
  if (option.get_items_expected_max() == 0 || option.get_positional()) return head;
  const std::string type =
      absl::StrReplaceAll(option.get_type_name().empty() ? "VALUE" : option.get_type_name(),
                          {{"\\", "\\e"}, {"-", "\\-"}});
  return absl::StrCat(head, " \\fI", type, "\\fR");
}

std::string OptionEntry(const CLI::Option& option) {
  std::string what = option.get_description();
  if (!option.get_default_str().empty()) {
    absl::StrAppend(&what, " (default ", option.get_default_str(), ")");
  }
  if (option.get_required()) absl::StrAppend(&what, " (required)");
  return absl::StrCat(".TP\n", OptionHead(option), "\n", Text(what));
}

// The options of a program or verb, group by group.
std::string Options(const CLI::App& app, bool is_verb) {
  std::vector<std::string> groups;
  for (const CLI::Option* option : app.get_options()) {
    const std::string& group = option->get_group();
    // Without a group an option is hidden.
    if (group.empty() || std::find(groups.begin(), groups.end(), group) != groups.end()) continue;
    groups.push_back(group);
  }
  std::string text;
  for (const std::string& group : groups) {
    if (group != "Options" && !is_verb) absl::StrAppend(&text, ".SS ", Text(group));
    for (const CLI::Option* option : app.get_options()) {
      // Every verb has a help.
      if (option->get_group() != group || (is_verb && option == app.get_help_ptr())) continue;
      absl::StrAppend(&text, OptionEntry(*option));
    }
  }
  return text;
}

std::string Positionals(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional() || option->get_group().empty()) continue;
    const std::string name = absl::StrReplaceAll(option->get_name(true), {{"-", "\\-"}});
    const bool is_list = option->get_expected_max() > 1;
    absl::StrAppend(&text, " ", option->get_required() ? "" : "[", "\\fI", name, "\\fR",
                    is_list ? "..." : "", option->get_required() ? "" : "]");
  }
  return text;
}

std::string VerbSection(const CLI::App& verb) {
  std::string text =
      absl::StrCat(".SS ", Text(verb.get_name()), Text(absl::StrCat(verb.get_description(), ".")));
  absl::StrAppend(&text, Options(verb, true));
  const std::string notes = Paragraphs(verb.get_footer());
  return notes.empty() ? text : absl::StrCat(text, ".PP\n", notes);
}

// The verbs under the headings of their groups. Without a group a verb is hidden.
std::string Verbs(const std::vector<const CLI::App*>& verbs) {
  std::string text;
  std::string group;
  for (const CLI::App* verb : verbs) {
    if (verb->get_group().empty()) continue;
    if (verb->get_group() != group) {
      group = verb->get_group();
      const bool is_default = group == "Subcommands";
      absl::StrAppend(&text, ".SH ", is_default ? "VERBS\n" : Text(absl::AsciiStrToUpper(group)));
    }
    absl::StrAppend(&text, VerbSection(*verb));
  }
  return text;
}

std::string Today() {
  int64_t seconds = WallClockNs() / kNsPerSecond;
  const char* fixed = std::getenv("SOURCE_DATE_EPOCH");
  int64_t given = 0;
  if (fixed != nullptr && absl::SimpleAtoi(fixed, &given) && given >= 0 &&
      given < kTimeMax / kNsPerSecond) {
    seconds = given;
  }
  return FormatRfc3339(seconds * kNsPerSecond).substr(0, 10);
}

}  // namespace

std::string ManualPage(const CLI::App& app, const std::string& version, const std::string& date) {
  const std::string name = app.get_name();
  std::string what = app.get_description();
  if (absl::StartsWith(what, name + ": ")) what = what.substr(name.size() + 2);
  if (!what.empty() && what.back() == '.') what.pop_back();
  const std::vector<const CLI::App*> verbs = app.get_subcommands({});
  std::string page =
      absl::StrCat(".TH ", absl::AsciiStrToUpper(name), " 1 ", date, " \"dsgdb ", version,
                   "\"\n.SH NAME\n", Text(absl::StrCat(name, " - ", what)), ".SH SYNOPSIS\n.B ",
                   name, "\n", verbs.empty() ? "" : "\\fIVERB\\fR ", "[\\fIOPTION\\fR]...",
                   verbs.empty() ? Positionals(app) : " [\\fIARGUMENT\\fR]...", "\n");
  absl::StrAppend(&page, ".SH OPTIONS\n", Options(app, false));
  absl::StrAppend(&page, Verbs(verbs));
  const std::string notes = Paragraphs(app.get_footer());
  return notes.empty() ? page : absl::StrCat(page, ".SH NOTES\n", notes);
}

void AddManual(CLI::App* app, const std::string& version) {
  const auto print = [app, version] {
    std::string page = ManualPage(*app, version, Today());
    // App::exit ends what it prints with a line end.
    page.erase(page.find_last_not_of('\n') + 1);
    throw CLI::CallForVersion(page, CLI::ExitCodes::Success);
  };
  app->add_flag_callback(kManualFlag, print, "Print the manual page")
      ->group("")
      ->configurable(false);
}

}  // namespace dsg
