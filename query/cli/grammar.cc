// SPDX-License-Identifier: Apache-2.0
#include "query/cli/grammar.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "query/cli/export/top_view.h"
#include "query/client/credential_flags.h"
#include "schema/base/time.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"

namespace dsg::cli {
namespace {

// Empty if the text is a revision or may be a tag; else what is wrong.
std::string RevisionProblem(const std::string& text) {
  int64_t number = 0;
  if (absl::SimpleAtoi(text, &number) && number >= 0) return "";
  const bool is_number =
      !text.empty() && text.find_first_not_of("+-.0123456789") == std::string::npos;
  if (!text.empty() && !is_number) return "";
  return absl::StrCat("\"", text, "\" is neither a revision number, from 0 on, nor a tag");
}

// Empty if the text is a date; else what is wrong. Stamps of commits are of the wall clock,
// whatever clock the map has.
std::string DateProblem(const std::string& text) {
  const bool is_date = absl::StrContains(text, "T") && ParseTime(text, 0).ok();
  if (is_date) return "";
  return absl::StrCat("\"", text,
                      "\" is no date; write it in UTC or with its zone, like 2014-06-25T16:58:44Z "
                      "or 2014-06-25T18:58:44+02:00");
}

void AddReadAt(CLI::App* app, RevisionOption* at) {
  CLI::Option* revision =
      AddRevision(app, "--revision", "Read at this revision or tag; default the newest", at);
  // Behind the check the text is a date.
  const auto take = [at](const std::string& text) {
    at->committed_at_ns = ParseTime(text, 0).value_or(0);
  };
  app->add_option_function<std::string>("--as-of", take,
                                        "Read at the newest revision committed by this date")
      ->check(CLI::Validator(DateProblem, "DATE"))
      ->excludes(revision);
}

// CLI11 puts the option's name before what a check says; empty means that the text passes.
CLI::Validator NumberCheck(const std::string& form, const std::string& what,
                           const std::function<bool(const std::string&)>& passes) {
  return CLI::Validator(
      [what, passes](const std::string& text) {
        return passes(text) ? std::string() : absl::StrCat("\"", text, "\" is not ", what);
      },
      form);
}

CLI::Validator RealCheck(const std::string& form, const std::string& what,
                         const std::function<bool(double)>& passes) {
  return NumberCheck(form, what, [passes](const std::string& text) {
    double number = 0.0;
    return absl::SimpleAtod(text, &number) && std::isfinite(number) && passes(number);
  });
}

CLI::Validator WholeCheck(const std::string& form, const std::string& what, int64_t low) {
  return NumberCheck(form, what, [low](const std::string& text) {
    int64_t number = 0;
    return absl::SimpleAtoi(text, &number) && number >= low;
  });
}

ListFormat FormatOf(const std::string& name) {
  if (name == "csv") return ListFormat::kCsv;
  return name == "jsonl" ? ListFormat::kJsonLines : ListFormat::kTable;
}

}  // namespace

absl::Status Usage(const std::string& message, const std::string& verb) {
  return absl::InvalidArgumentError(
      absl::StrCat(message, "; see dsg ", verb, verb.empty() ? "" : " ", "--help"));
}

Grammar::Grammar(const std::string& version) {
  app_.name("dsg");
  app_.require_subcommand(1);
  UseVerbUsage(&app_);
  app_.footer(absl::StrCat("dsg help VERB explains a verb.\n", kTimeHelp));
  AddManual(&app_, version);
}

CLI::App* Grammar::AddApp(const std::string& name, const std::string& what,
                          const std::string& example, const std::string& footer, unsigned takes) {
  CLI::App* app = app_.add_subcommand(name, what);
  app->group(heading_);
  app->footer(
      absl::StrCat("Example: dsg ", name, example.empty() ? "" : " ", example, "\n", footer));
  CommonOptions& common = command_.common;
  app->add_option("--store", common.store, "Folder of the store (or DSG_STORE)");
  if (takes & kServer) {
    app->add_option("--server", common.server,
                    "unix:PATH or HOST:PORT of a dsg-server (or DSG_SERVER); --token-file, "
                    "--tls-ca, --tls-cert and --tls-key FILE tell it who calls (docs/access.md)");
    client::AddCredentialFlags(app, &common.credentials, /*is_hidden=*/true);
    app->add_option("--timeout", common.timeout_s, "Deadline of each call, seconds")
        ->check(Between(0.001, 86400.0));
  }
  if (takes & kMap) {
    app->add_option("--map", common.map,
                    "Name of the map (or DSG_MAP); default the only map of the store");
  }
  if (takes & kMapFilter) app->add_option("--map", common.map, "Only this map; default all");
  if (takes & kRevision) {
    AddReadAt(app, &common.at);
  }
  if (takes & kJson) app->add_flag("--json", common.json, "Print the reply as protobuf JSON");
  if (takes & kFormat) {
    app->add_option_function<std::string>(
           "--format", [&common](const std::string& format) { common.format = FormatOf(format); },
           "table, csv (exact numbers, times in ns), or jsonl: an entry a line, as in --json")
        ->check(CLI::IsMember({"table", "csv", "jsonl"}))
        ->excludes(app->get_option("--json"));
  }
  if (takes & kLimit) {
    app->add_option("--limit", common.limit, "List at most this many entries")
        ->check(WholeAboveZero());
  }
  return app;
}

namespace {

// "help VERB" as "VERB --help".
void ReplaceHelp(std::vector<std::string>* arguments) {
  if (arguments->empty() || (*arguments)[0] != "help") return;
  arguments->erase(arguments->begin());
  if (arguments->size() <= 1) arguments->push_back("--help");
}

// Of a verb without arguments, a word that is empty and no value of an option: CLI11 would look for
// its end among groups of options for ever.
bool HasStrayEmptyWord(const CLI::App& verb, const std::vector<std::string>& words) {
  const std::vector<const CLI::Option*> options = verb.get_options();
  if (std::any_of(options.begin(), options.end(),
                  [](const CLI::Option* option) { return option->get_positional(); })) {
    return false;
  }
  for (size_t i = 1; i < words.size(); ++i) {
    const CLI::Option* before = verb.get_option_no_throw(words[i - 1]);
    const bool is_value = before != nullptr && before->get_expected_max() > 0;
    if (words[i].empty() && !is_value) return true;
  }
  return false;
}

// Help is asked for of a word that is no verb.
bool NamesNoVerb(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining();
  return app.get_subcommands().empty() && !words.empty() && !absl::StartsWith(words[0], "-");
}

}  // namespace

absl::Status Grammar::Parse(std::vector<std::string> arguments) {
  ReplaceHelp(&arguments);
  if (!arguments.empty() && arguments[0] == "--version") arguments[0] = "version";
  const std::string verb_name = arguments.empty() ? "" : arguments[0];
  if (const std::string empty = OptionWithoutValue(arguments); !empty.empty()) {
    return Usage(absl::StrCat(empty, " is empty; give a value, or leave it out"), verb_name);
  }
  const std::vector<CLI::App*> named =
      app_.get_subcommands([&](const CLI::App* verb) { return verb->check_name(verb_name); });
  if (!named.empty() && HasStrayEmptyWord(*named.front(), arguments)) {
    return Usage("not understood: an empty word", verb_name);
  }
  // CLI11 takes them last first.
  std::reverse(arguments.begin(), arguments.end());
  try {
    app_.parse(std::move(arguments));
  } catch (const CLI::CallForHelp& call) {
    if (NamesNoVerb(app_)) return absl::InvalidArgumentError(UsageMessage(app_, call));
    // The help of the verb, if one is named.
    command_.help = app_.help();
  } catch (const CLI::CallForVersion& manual) {
    command_.help = absl::StrCat(manual.what(), "\n");
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(UsageMessage(app_, error));
  }
  const std::vector<CLI::App*> verbs = app_.get_subcommands();
  return verbs.empty() ? absl::OkStatus() : CheckNothingIsEmpty(verbs.front()->get_name());
}

absl::Status Grammar::CheckNothingIsEmpty(const std::string& verb) const {
  for (const CLI::Option* option : app_.get_subcommand(verb)->get_options()) {
    if (option->count() == 0 || may_be_empty_.contains(option)) continue;
    const std::vector<std::string>& values = option->results();
    if (std::find(values.begin(), values.end(), "") == values.end()) continue;
    return Usage(absl::StrCat(option->get_name(), " is empty; give a value, or leave it out"),
                 verb);
  }
  return absl::OkStatus();
}

void AddFilter(CLI::App* app, FilterOptions* filter) {
  app->add_option("--layer", filter->layer, "Only nodes of this layer");
  app->add_option("--kind", filter->kind, "Only nodes of this kind: object, room, human, ...");
  app->add_option("--class", filter->class_name, "Only nodes of this semantic class");
  app->add_option("--at", filter->at, "Only nodes that existed at this TIME");
}

void AddPicture(CLI::App* app, const std::string& what, PictureOptions* picture) {
  CLI::Option* png =
      app->add_option("--png", picture->png, "Also draw " + what + " on the map, to this PNG file")
          ->check(EndsIn({".png"}));
  app->add_option("--floor", picture->floor, kFloorHelp)->needs(png);
  app->add_option("--width", picture->width_px, "Width of the picture, pixels")
      ->check(Between(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str()
      ->needs(png);
  app->add_flag("--force", picture->force, "Replace an existing picture")->needs(png);
}

CLI::Option* AddRevision(CLI::App* app, const std::string& name, const std::string& what,
                         RevisionOption* revision) {
  const auto take = [revision](const std::string& text) {
    int64_t number = 0;
    if (absl::SimpleAtoi(text, &number)) {
      revision->number = number;
    } else {
      revision->tag = text;
    }
  };
  return app->add_option_function<std::string>(name, take, what)
      ->check(CLI::Validator(RevisionProblem, "REVISION|TAG"));
}

CLI::Validator AboveZero() {
  return RealCheck("POSITIVE", "a number above zero", [](double number) { return number > 0.0; });
}

CLI::Validator ZeroOrMore() {
  return RealCheck("NONNEGATIVE", "a number of at least zero",
                   [](double number) { return number >= 0.0; });
}

CLI::Validator WholeAboveZero() { return WholeCheck("POSITIVE", "a whole number above zero", 1); }

CLI::Validator WholeZeroOrMore() {
  return WholeCheck("NONNEGATIVE", "a whole number of at least zero", 0);
}

CLI::Validator Between(double low, double high) {
  return RealCheck(absl::StrCat("in [", low, " - ", high, "]"),
                   absl::StrCat("a number from ", low, " to ", high),
                   [low, high](double number) { return number >= low && number <= high; });
}

namespace {

// The format of files that end so.
std::string FormatName(const std::string& ending) {
  if (ending == ".glb") return "binary glTF";
  if (ending == ".geojson") return "GeoJSON";
  // Of Spark-DSG, text or binary.
  if (ending == ".json") return "a Spark-DSG graph";
  return absl::AsciiStrToUpper(ending.substr(1));
}

}  // namespace

CLI::Validator EndsIn(const std::vector<std::string>& endings) {
  const auto check = [endings](const std::string& path) {
    const bool fits = std::any_of(endings.begin(), endings.end(), [&](const std::string& ending) {
      return path.size() > ending.size() && absl::EndsWithIgnoreCase(path, ending);
    });
    // That an empty name is none is said of all options alike.
    if (fits || path.empty()) return std::string();
    const std::string given = absl::StrCat("\"", path, "\": only ", FormatName(endings.front()));
    if (endings.size() > 1) {
      return absl::StrCat(given, " is written: end the name in ", absl::StrJoin(endings, ", "));
    }
    return absl::StrCat(given, " is written: name it ",
                        std::filesystem::path(path).replace_extension(endings.front()).string());
  };
  return CLI::Validator(check, absl::StrCat("FILE", absl::StrJoin(endings, "|")));
}

}  // namespace dsg::cli
