// SPDX-License-Identifier: Apache-2.0
#include "schema/program/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/exit_code.h"
#include "schema/base/printable.h"
#include "schema/base/spelling.h"
#include "schema/base/utf8.h"

namespace dsg {
namespace {

using Words = std::vector<std::string>;

// The options come after the verb, whatever is a program's own: its help and version.
class VerbUsage : public CLI::Formatter {
 public:
  std::string make_usage(const CLI::App* app, std::string name) const override {
    if (app->get_subcommands({}).empty()) {
      return CLI::Formatter::make_usage(app, std::move(name));
    }
    return absl::StrCat("Usage: ", name, " VERB [OPTIONS]\n");
  }
};

Words VerbNames(const CLI::App& app) {
  Words names;
  for (const CLI::App* verb : app.get_subcommands({})) names.push_back(verb->get_name());
  return names;
}

// Those that the help shows.
void AddOptionNames(const CLI::App& app, Words* names) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const std::string& name : option->get_lnames()) names->push_back("--" + name);
  }
}

// The verb of the command line; nullptr if there is none.
const CLI::App* ChosenVerb(const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  return chosen.empty() ? nullptr : chosen.front();
}

// The words that nothing took, in their order: of the program alone, or of its verb too. The "--"
// before arguments is none.
Words NotTaken(const CLI::App& app, bool also_of_verb) {
  Words words = app.remaining(also_of_verb);
  std::erase(words, "--");
  return words;
}

std::string NameOfOption(const std::string& word) { return word.substr(0, word.find('=')); }

// The first of the words that looks like an option may be one of `known`, misspelt.
std::string NotUnderstood(const Words& words, const Words& known) {
  const auto option = std::find_if(words.begin(), words.end(), [](const std::string& word) {
    return absl::StartsWith(word, "--");
  });
  const std::string hint = option == words.end() ? "" : NearHint(NameOfOption(*option), known);
  return absl::StrCat("not understood: ", absl::StrJoin(words, " "), hint);
}

bool HasOption(const CLI::App& app, const std::string& name) {
  const std::vector<const CLI::Option*> options = app.get_options();
  return std::any_of(options.begin(), options.end(),
                     [&](const CLI::Option* option) { return option->check_name(name); });
}

// Of options before the verb, or without one.
std::string EarlyOptions(const CLI::App& app, const Words& words) {
  const std::vector<const CLI::App*> verbs = app.get_subcommands({});
  const std::string name = NameOfOption(words.front());
  const CLI::App* chosen = ChosenVerb(app);
  if (std::any_of(verbs.begin(), verbs.end(),
                  [&](const CLI::App* verb) { return HasOption(*verb, name); })) {
    return absl::StrCat("options come after the verb: ", app.get_name(), " ",
                        chosen == nullptr ? "VERB" : chosen->get_name(), " ",
                        absl::StrJoin(words, " "));
  }
  Words known = VerbNames(app);
  AddOptionNames(app, &known);
  for (const CLI::App* verb : verbs) AddOptionNames(*verb, &known);
  return NotUnderstood(words, known);
}

std::string NoVerb(const CLI::App& app) {
  constexpr size_t kNamedMax = 4;
  Words names = VerbNames(app);
  if (names.size() > kNamedMax) {
    names.resize(kNamedMax);
    names.push_back("...");
  }
  return absl::StrCat("name a verb: ", absl::StrJoin(names, ", "));
}

struct Complaint {
  std::string text;
  // Whose help tells more; nullptr for the program's.
  const CLI::App* verb = nullptr;
};

Complaint ComplaintOf(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* verb = ChosenVerb(app);
  const Words verbs = VerbNames(app);
  const Words early = NotTaken(app, false);
  if (!verbs.empty() && !early.empty()) {
    const std::string& first = early.front();
    if (absl::StartsWith(first, "-")) return {EarlyOptions(app, early), verb};
    return {absl::StrCat("there is no verb \"", first, "\"", NearHint(first, verbs))};
  }
  // CLI11 would only say that a subcommand is missing.
  if (!verbs.empty() && verb == nullptr && error.get_name() == "RequiredError") {
    return {NoVerb(app)};
  }
  const Words unknown = NotTaken(app, true);
  if (unknown.empty()) return {error.what(), verb};
  Words known;
  AddOptionNames(verb == nullptr ? app : *verb, &known);
  return {NotUnderstood(unknown, known), verb};
}

std::string SeeHelp(const CLI::App& app, const CLI::App* verb) {
  return absl::StrCat("; see ", app.get_name(), " ",
                      verb == nullptr ? "" : absl::StrCat(verb->get_name(), " "), "--help");
}

}  // namespace

std::string UsageMessage(const CLI::App& app, const CLI::ParseError& error) {
  constexpr size_t kShownBytesMax = 1000;
  const Complaint complaint = ComplaintOf(app, error);
  const std::string shown(Utf8Prefix(complaint.text, kShownBytesMax));
  return absl::StrCat(Printable(shown), shown.size() < complaint.text.size() ? "..." : "",
                      SeeHelp(app, complaint.verb));
}

std::string OptionWithoutValue(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (word == "--") break;
    if (absl::StartsWith(word, "--") && absl::EndsWith(word, "=")) return NameOfOption(word);
  }
  return "";
}

void UseVerbUsage(CLI::App* app) { app->formatter(std::make_shared<VerbUsage>()); }

std::optional<int> ReadCommandLine(int argc, char** argv, CLI::App* app) {
  if (const std::string empty = OptionWithoutValue(Words(argv + 1, argv + argc)); !empty.empty()) {
    TellError(app->get_name(), absl::StrCat(empty, " is empty; give a value, or leave it out",
                                            SeeHelp(*app, nullptr)));
    return kUsage;
  }
  try {
    app->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    // A help, a version, a manual.
    if (error.get_exit_code() == 0) return app->exit(error);
    TellError(app->get_name(), UsageMessage(*app, error));
    return kUsage;
  }
}

void TellError(const std::string& program, const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), PrintableMessage(message).c_str());
}

void TellNote(const std::string& about, const std::string& note) {
  TellError(Printable(about), absl::StrCat("note: ", note));
}

int TellError(const CLI::App& app, const absl::Status& status) {
  if (status.ok()) return kDone;
  TellError(app.get_name(),
            absl::StrCat(absl::StatusCodeToString(status.code()), ": ", status.message()));
  return ExitCodeOf(status);
}

int RunProgram(int argc, char** argv, CLI::App* app, const std::function<absl::Status()>& run) {
  const std::optional<int> end = ReadCommandLine(argc, argv, app);
  const int code = end.has_value() ? *end : TellError(*app, run());
  return code == kDone ? TellError(*app, FinishOutput()) : code;
}

}  // namespace dsg
