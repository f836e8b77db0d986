// SPDX-License-Identifier: Apache-2.0
#include "query/cli/arguments.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "query/cli/spark_export.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// Fills in from the environment what the command line leaves open. A place named on the command
// line hides both variables, so that --server is not refused because DSG_STORE is set. Where --map
// narrows or renames what would be dealt with otherwise, a variable must not do it unseen.
absl::Status SettlePlace(const Environment& environment, bool map_is_asked, CommonOptions* common) {
  if (common->store.empty() && common->server.empty()) {
    common->store = environment.store;
    common->server = environment.server;
  }
  if (!common->store.empty() && !common->server.empty()) {
    return Usage(absl::StrCat("both a store (", common->store, ") and a server (", common->server,
                              ") are given; name one with --store or --server"),
                 "");
  }
  if (common->map.empty() && map_is_asked) common->map = environment.map;
  return absl::OkStatus();
}

// An archive is checked, or imported, under its own name.
bool NamesArchive(const Verb& verb) {
  const auto* verify = std::get_if<VerifyVerb>(&verb);
  const auto* import = std::get_if<ImportVerb>(&verb);
  return (verify != nullptr && !verify->path.empty()) ||
         (import != nullptr && IsArchivePath(import->file));
}

absl::Status CheckPlace(const Command& command) {
  if (std::holds_alternative<VersionVerb>(command.verb)) return absl::OkStatus();
  const CommonOptions& common = command.common;
  const auto* verify = std::get_if<VerifyVerb>(&command.verb);
  if (verify != nullptr && !verify->path.empty()) return absl::OkStatus();
  if (std::holds_alternative<RestoreVerb>(command.verb) && common.store.empty()) {
    return Usage("restore writes to a store folder: give --store DIR", "restore");
  }
  const bool is_import = std::holds_alternative<ImportVerb>(command.verb);
  const bool needs_store = is_import || std::holds_alternative<VerifyVerb>(command.verb) ||
                           std::holds_alternative<UpgradeVerb>(command.verb);
  if (needs_store && common.store.empty()) {
    return is_import ? Usage(
                           "import writes to a store folder: give --store DIR (for a server: "
                           "dsg-ingest --server ADDR)",
                           "import")
           : std::holds_alternative<UpgradeVerb>(command.verb)
               ? Usage("upgrade works on a store folder: give --store DIR", "upgrade")
               : Usage("verify reads a store folder: give --store DIR", "verify");
  }
  if (is_import && common.map.empty() && !NamesArchive(command.verb))
    return Usage("name the map to import into with --map NAME", "import");
  if (common.store.empty() && common.server.empty()) {
    return Usage(
        "say where the maps are: --store DIR or --server ADDR (or set DSG_STORE or "
        "DSG_SERVER)",
        "");
  }
  return absl::OkStatus();
}

absl::Status Check(const WhoVerb& verb) {
  if (!verb.room.empty() || !verb.box.empty()) return absl::OkStatus();
  return Usage("who asks about one place: give --room ID or --box X0,Y0,Z0,X1,Y1,Z1", "who");
}

absl::Status Check(const ExportVerb& verb) {
  if (!verb.archive.empty()) {
    if (IsArchivePath(verb.archive)) return absl::OkStatus();
    return Usage(
        absl::StrCat("\"", verb.archive, "\" is no .dsgz file; other formats have options"),
        "export");
  }
  if (!verb.spark.empty() && !SparkFormOf(verb.spark).has_value()) {
    return Usage(absl::StrCat("--spark \"", verb.spark,
                              "\": end the name in .json, or in .sparkdsg or .bin for the binary "
                              "form"),
                 "export");
  }
  const std::string* const paths[] = {&verb.ply, &verb.graph_ply, &verb.gltf, &verb.spark};
  const bool has_file = std::any_of(std::begin(paths), std::end(paths),
                                    [](const std::string* path) { return !path->empty(); });
  if (has_file) return absl::OkStatus();
  return Usage(
      "export writes files: give FILE.dsgz, --ply FILE, --graph-ply FILE, --gltf FILE or --spark "
      "FILE",
      "export");
}

absl::Status Check(const CollideVerb& verb) {
  const bool given[] = {verb.sphere_radius_m > 0.0, !verb.box.empty(), !verb.capsule.empty(),
                        !verb.mesh_file.empty()};
  if (std::count(std::begin(given), std::end(given), true) == 1) return absl::OkStatus();
  return Usage(
      "collide asks about one body: give one of --sphere RADIUS, --box X,Y,Z, --capsule "
      "RADIUS,LENGTH, --mesh FILE.ply",
      "collide");
}

// The other verbs are complete if the grammar let them through.
template <class V>
absl::Status Check(const V&) {
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Command> ParseArguments(const std::vector<std::string>& arguments,
                                       const Environment& environment) {
  Grammar grammar;
  AddAgentVerbs(&grammar);
  AddMeetingVerbs(&grammar);
  AddGraphVerbs(&grammar);
  AddSearchVerbs(&grammar);
  AddSpaceVerbs(&grammar);
  AddRevisionVerbs(&grammar);
  AddMapVerbs(&grammar);
  AddFileVerbs(&grammar);
  AddKeepVerbs(&grammar);
  AddMergeVerb(&grammar);
  AddPruneVerb(&grammar);
  for (const auto add : kOwnVerbs) add(&grammar);
  DSG_RETURN_IF_ERROR(grammar.Parse(arguments));
  Command command = grammar.command();
  if (std::holds_alternative<HelpVerb>(command.verb)) return command;
  const bool is_about_all = std::holds_alternative<BackupVerb>(command.verb) ||
                            std::holds_alternative<RestoreVerb>(command.verb) ||
                            std::holds_alternative<VerifyVerb>(command.verb) ||
                            NamesArchive(command.verb);
  DSG_RETURN_IF_ERROR(SettlePlace(environment, !is_about_all, &command.common));
  DSG_RETURN_IF_ERROR(CheckPlace(command));
  DSG_RETURN_IF_ERROR(std::visit([](const auto& verb) { return Check(verb); }, command.verb));
  return command;
}

}  // namespace dsg::cli
