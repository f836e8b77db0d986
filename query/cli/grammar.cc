// SPDX-License-Identifier: Apache-2.0
#include "query/cli/grammar.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "query/cli/export/top_view.h"
#include "query/cli/number_checks.h"

namespace dsg::cli {

absl::Status Usage(const std::string& message, const std::string& verb) {
  return absl::InvalidArgumentError(
      absl::StrCat(message, "; see dsg ", verb, verb.empty() ? "" : " ", "--help"));
}

Grammar::Grammar() {
  app_.name("dsg");
  app_.require_subcommand(1);
  app_.footer(kTimeHelp);
}

CLI::App* Grammar::AddApp(const std::string& name, const std::string& what, unsigned takes) {
  CLI::App* app = app_.add_subcommand(name, what);
  app->footer(ExampleOf(name) + kTimeHelp);
  CommonOptions& common = command_.common;
  app->add_option("--store", common.store, "Folder of the store (or DSG_STORE)");
  if (takes & kServer) {
    app->add_option("--server", common.server,
                    "unix:PATH or HOST:PORT of a dsg-server (or DSG_SERVER)");
    app->add_option("--timeout", common.timeout_s, "Bound on each call, seconds")
        ->check(Between(0.001, 86400.0));
  }
  if (takes & kMap) {
    app->add_option("--map", common.map, "Name of the map (or DSG_MAP); may be left out if alone");
  }
  if (takes & kRevision) {
    AddRevision(app, "--revision", "As believed at this revision or tag; default newest",
                &revision_);
  }
  if (takes & kJson) app->add_flag("--json", common.json, "Print the reply as protobuf JSON");
  if (takes & kLimit) {
    app->add_option("--limit", common.limit, "List at most this many")->check(WholeAboveZero());
  }
  return app;
}

absl::Status Grammar::Parse(std::vector<std::string> arguments) {
  // CLI11 would only say that a subcommand is missing.
  if (arguments.empty()) return Usage("say what is wanted: where, who, find, path, ...", "");
  if (arguments[0] == "--version") arguments[0] = "version";
  const std::string first = arguments[0];
  const auto is_first = [&](const CLI::App* verb) { return verb->check_name(first); };
  const bool is_verb = !app_.get_subcommands(is_first).empty();
  if (!is_verb && first != "-h" && first != "--help") {
    return Usage(absl::StrCat("there is no verb \"", first, "\""), "");
  }
  // CLI11 takes them last first.
  std::reverse(arguments.begin(), arguments.end());
  try {
    app_.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    // Help of the verb that was named, if one was.
    command_.verb = HelpVerb{app_.help()};
  } catch (const CLI::ExtrasError&) {
    return Usage(absl::StrCat("not understood: ", absl::StrJoin(app_.remaining(true), " ")),
                 is_verb ? first : "");
  } catch (const CLI::ParseError& error) {
    return Usage(error.what(), is_verb ? first : "");
  }
  command_.common.revision = revision_.number;
  command_.common.tag = revision_.tag;
  return absl::OkStatus();
}

void AddFilter(CLI::App* app, FilterOptions* filter) {
  app->add_option("--layer", filter->layer, "Only nodes of this layer");
  app->add_option("--kind", filter->kind, "Only nodes of this kind: object, room, human, ...");
  app->add_option("--class", filter->class_name, "Only nodes of this semantic class");
  app->add_option("--at", filter->at, "Only nodes that existed at this TIME");
}

void AddPicture(CLI::App* app, const std::string& what, PictureOptions* picture) {
  CLI::Option* png = app->add_option("--png", picture->png, "Also draw " + what + " on the map");
  app->add_option("--floor", picture->floor, kFloorHelp)->needs(png);
  app->add_option("--width", picture->width_px, "Pixels of the picture; the height follows")
      ->check(Between(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str()
      ->needs(png);
  app->add_flag("--force", picture->force, "Replace a picture that is there")->needs(png);
}

}  // namespace dsg::cli
