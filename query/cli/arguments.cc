// SPDX-License-Identifier: Apache-2.0
#include "query/cli/arguments.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "query/cli/export/top_view.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// Which of the common options a verb takes; --store and --timeout go with all of them.
enum Takes : unsigned {
  kServer = 1,
  kMap = 2,
  kRevision = 4,
  kJson = 8,
  kLimit = 16,
  kQuestion = kServer | kMap | kRevision | kJson,
};

// Builds the parser. Options write straight into `command_`; the verb is put into it by the
// callback of the subcommand that was named.
class Grammar {
 public:
  Grammar();
  absl::Status Parse(std::vector<std::string> arguments);
  const Command& command() const { return command_; }

 private:
  CLI::App* AddVerb(const std::string& name, const std::string& what, unsigned takes);
  template <class V>
  CLI::App* AddVerb(const std::string& name, const std::string& what, unsigned takes, V* verb) {
    CLI::App* app = AddVerb(name, what, takes);
    app->callback([this, verb] { command_.verb = *verb; });
    return app;
  }
  void AddAgentVerbs();
  void AddShape();
  void AddWho();
  void AddFilter(CLI::App* app, FilterOptions* filter);
  void AddGraphVerbs();
  void AddNear();
  void AddMapVerbs();
  void AddStoreVerbs();
  void AddFileVerbs();

  CLI::App app_{"Asks a store of dynamic scene graphs, or a server, where and when."};
  Command command_;
  WhereVerb where_;
  TrackVerb track_;
  ShapeVerb shape_;
  WhoVerb who_;
  ListVerb list_;
  EdgesVerb edges_;
  ShowVerb show_;
  NearVerb near_;
  LogVerb log_;
  StatsVerb stats_;
  MapsVerb maps_;
  VersionVerb version_;
  VerifyVerb verify_;
  ImportVerb import_;
  ExportVerb export_;
  MapVerb map_;
};

constexpr char kTimeHelp[] =
    "TIME is +12.5s from the map's epoch, RFC 3339, or nanoseconds.\n"
    "Exit codes: 0 found, 1 not found, 2 usage, 3 unavailable, 4 data loss.";

Grammar::Grammar() {
  app_.name("dsg");
  app_.require_subcommand(1);
  app_.footer(kTimeHelp);
  AddAgentVerbs();
  AddShape();
  AddWho();
  AddGraphVerbs();
  AddNear();
  AddMapVerbs();
  AddStoreVerbs();
  AddFileVerbs();
}

CLI::App* Grammar::AddVerb(const std::string& name, const std::string& what, unsigned takes) {
  CLI::App* app = app_.add_subcommand(name, what);
  CommonOptions& common = command_.common;
  app->add_option("--store", common.store, "Folder of the store (or DSG_STORE)");
  if (takes & kServer) {
    app->add_option("--server", common.server,
                    "unix:PATH or HOST:PORT of a dsg-server (or DSG_SERVER)");
    app->add_option("--timeout", common.timeout_s, "Bound on each call, seconds")
        ->check(CLI::Range(0.001, 86400.0));
  }
  if (takes & kMap) {
    app->add_option("--map", common.map, "Name of the map (or DSG_MAP); may be left out if alone");
  }
  if (takes & kRevision) {
    app->add_option("--revision", common.revision, "As believed at this revision; default newest")
        ->check(CLI::NonNegativeNumber);
  }
  if (takes & kJson) app->add_flag("--json", common.json, "Print the reply as protobuf JSON");
  if (takes & kLimit) {
    app->add_option("--limit", common.limit, "List at most this many")->check(CLI::PositiveNumber);
  }
  return app;
}

void Grammar::AddAgentVerbs() {
  CLI::App* where = AddVerb("where", "Where an agent was at an instant", kQuestion, &where_);
  where->add_option("AGENT", where_.agent, "Node id (H12) or the log's name (12)")->required();
  where->add_option("--at", where_.at, "TIME asked about")->required();
  where->footer(kTimeHelp);

  CLI::App* track = AddVerb("track", "The poses of an agent", kQuestion | kLimit, &track_);
  track->add_option("AGENT", track_.agent, "Node id (H12) or the log's name (12)")->required();
  track->add_option("--from", track_.from, "First TIME; default the track's first pose");
  track->add_option("--to", track_.to, "TIME to stop before; default with the last pose");
  track->add_option("--every", track_.every, "Interpolate at this period: 0.5s, 200ms");
  track->footer(kTimeHelp);
}

void Grammar::AddShape() {
  CLI::App* shape = AddVerb("shape", "The body of an agent over time", kQuestion | kLimit, &shape_);
  shape->add_option("AGENT", shape_.agent, "Node id (H12) or the log's name (12)")->required();
  shape->add_option("--from", shape_.from, "First TIME; default the first body");
  shape->add_option("--to", shape_.to, "TIME to stop before; default with the last body");
  CLI::Option* ply = shape->add_option("--ply", shape_.ply, "Write the first body, binary PLY");
  CLI::Option* obj =
      shape->add_option("--obj", shape_.obj_folder, "Folder to write a Wavefront OBJ a body into");
  ply->excludes(obj);
  shape->add_flag("--force", shape_.force, "Replace files that are there");
  shape->footer(kTimeHelp);
}

void Grammar::AddWho() {
  CLI::App* who = AddVerb("who", "Who was in a room or a box, and when", kQuestion | kLimit, &who_);
  CLI::Option* room =
      who->add_option("--room", who_.room, "Room, place or region, by id (R2) or name");
  CLI::Option* box =
      who->add_option("--box", who_.box, "X0,Y0,Z0,X1,Y1,Z1 in the map frame, metres");
  room->excludes(box);
  who->add_option("--from", who_.from, "First TIME; default the first pose of the map");
  who->add_option("--to", who_.to, "TIME to stop before; default with the last pose");
  who->footer(kTimeHelp);
}

void Grammar::AddFilter(CLI::App* app, FilterOptions* filter) {
  app->add_option("--layer", filter->layer, "Only nodes of this layer");
  app->add_option("--kind", filter->kind, "Only nodes of this kind: object, room, human, ...");
  app->add_option("--class", filter->class_name, "Only nodes of this semantic class");
  app->add_option("--at", filter->at, "Only nodes that existed at this TIME");
  app->footer(kTimeHelp);
}

void Grammar::AddGraphVerbs() {
  CLI::App* list = AddVerb("ls", "List nodes", kQuestion | kLimit, &list_);
  AddFilter(list, &list_.filter);
  list->add_option("--parent", list_.parent, "Only children of this node");
  list->add_option("--name", list_.name, "Only nodes of exactly this name");
  list->add_option("--box", list_.box, "Only nodes that touch X0,Y0,Z0,X1,Y1,Z1, metres");

  CLI::App* edges = AddVerb("edges", "List edges", kQuestion | kLimit, &edges_);
  edges->add_option("--source", edges_.source, "Only edges from this node");
  edges->add_option("--relation", edges_.relation, "Only this relation: CONTAINS, ON, ...");
  edges->add_option("--target", edges_.target, "Only edges to this node");
  edges->add_option("--at", edges_.at, "Only edges that held at this TIME");
  edges->footer(kTimeHelp);

  CLI::App* show = AddVerb("show", "All that is known of one node", kQuestion, &show_);
  show->add_option("ID", show_.id, "Node id (O42) or a name that is unique")->required();
}

void Grammar::AddNear() {
  CLI::App* near = AddVerb("near", "The nodes nearest to a point", kQuestion, &near_);
  near->add_option("POSITION", near_.position, "X,Y,Z in the map frame, metres")->required();
  near->add_option("--k", near_.k, "How many")->check(CLI::Range(1, 1000))->capture_default_str();
  near->add_option("--max-distance", near_.max_distance_m, "No further than this, metres")
      ->check(CLI::PositiveNumber);
  AddFilter(near, &near_.filter);
}

void Grammar::AddMapVerbs() {
  AddVerb("log", "List the revisions of a map, newest first", kServer | kMap | kJson | kLimit,
          &log_);
  AddVerb("stats", "Counts and sizes of a map", kQuestion, &stats_);
  AddVerb("maps", "List the maps", kServer | kJson, &maps_);
  AddVerb("version", "Version of this program, and of the server if one is named", kServer | kJson,
          &version_);
}

void Grammar::AddStoreVerbs() {
  CLI::App* import =
      AddVerb("import", "Add a scene-graph file (Spark-DSG, Kimera) to a map", kMap, &import_);
  import->add_option("FILE", import_.file, "The file")->required();
  AddVerb("verify", "Check every page, row and revision of a map", kMap, &verify_);
}

void Grammar::AddFileVerbs() {
  CLI::App* to_file =
      AddVerb("export", "Write mesh and graph to files for 3D viewers", kQuestion, &export_);
  to_file->add_option("--ply", export_.ply, "The mesh, binary PLY");
  to_file->add_option("--graph-ply", export_.graph_ply, "The graph, PLY of points and lines");
  to_file->add_option("--gltf", export_.gltf, "Mesh and graph, binary glTF 2.0 (.glb)");
  to_file
      ->add_option("--color", export_.color,
                   "Mesh colours: rgb, label or instance; default rgb if there are any")
      ->check(CLI::IsMember({"rgb", "label", "instance"}));
  to_file->add_option("--at", export_.at, "The world at this TIME; default what has not ended");
  to_file->add_flag("--force", export_.force, "Replace files that are there");
  to_file->footer(kTimeHelp);

  CLI::App* map = AddVerb("map", "Draw a map from above", kQuestion, &map_);
  map->add_option("--png", map_.png, "The picture to write")->required();
  map->add_option("--floor", map_.floor,
                  "Only this floor: a level or room by id or name, or a height in metres");
  map->add_option("--width", map_.width_px, "Pixels; the height follows")
      ->check(CLI::Range(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str();
  map->add_option("--at", map_.at, "The world at this TIME; default what has not ended");
  map->add_flag("--force", map_.force, "Replace a file that is there");
  map->footer(kTimeHelp);
}

absl::Status Usage(const std::string& message) {
  return absl::InvalidArgumentError(absl::StrCat(message, "; see dsg --help"));
}

absl::Status Grammar::Parse(std::vector<std::string> arguments) {
  // CLI11 would only say that a subcommand is missing.
  const auto is_first = [&](const CLI::App* verb) { return verb->check_name(arguments[0]); };
  if (!arguments.empty() && arguments[0].substr(0, 1) != "-" &&
      app_.get_subcommands(is_first).empty()) {
    return Usage(absl::StrCat("there is no verb \"", arguments[0], "\""));
  }
  // CLI11 takes them last first.
  std::reverse(arguments.begin(), arguments.end());
  try {
    app_.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    // Help of the verb that was named, if one was.
    command_.verb = HelpVerb{app_.help()};
  } catch (const CLI::ParseError& error) {
    return Usage(error.what());
  }
  return absl::OkStatus();
}

// Fills in from the environment what the command line leaves open. A place named on the command
// line hides both variables, so that --server is not refused because DSG_STORE is set.
absl::Status SettlePlace(const Environment& environment, CommonOptions* common) {
  if (common->store.empty() && common->server.empty()) {
    common->store = environment.store;
    common->server = environment.server;
  }
  if (!common->store.empty() && !common->server.empty()) {
    return Usage(absl::StrCat("both a store (", common->store, ") and a server (", common->server,
                              ") are given; name one with --store or --server"));
  }
  if (common->map.empty()) common->map = environment.map;
  return absl::OkStatus();
}

absl::Status CheckPlace(const Command& command) {
  if (std::holds_alternative<VersionVerb>(command.verb)) return absl::OkStatus();
  const CommonOptions& common = command.common;
  const bool is_import = std::holds_alternative<ImportVerb>(command.verb);
  const bool needs_store = is_import || std::holds_alternative<VerifyVerb>(command.verb);
  if (needs_store && common.store.empty()) {
    return Usage(is_import ? "import writes to a store folder: give --store DIR (for a server: "
                             "dsg-ingest --server ADDR)"
                           : "verify reads a store folder: give --store DIR");
  }
  if (is_import && common.map.empty()) return Usage("name the map to import into with --map NAME");
  if (common.store.empty() && common.server.empty()) {
    return Usage(
        "say where the maps are: --store DIR or --server ADDR (or set DSG_STORE or "
        "DSG_SERVER)");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Command> ParseArguments(const std::vector<std::string>& arguments,
                                       const Environment& environment) {
  Grammar grammar;
  DSG_RETURN_IF_ERROR(grammar.Parse(arguments));
  Command command = grammar.command();
  if (std::holds_alternative<HelpVerb>(command.verb)) return command;
  DSG_RETURN_IF_ERROR(SettlePlace(environment, &command.common));
  DSG_RETURN_IF_ERROR(CheckPlace(command));
  const auto* who = std::get_if<WhoVerb>(&command.verb);
  if (who != nullptr && who->room.empty() && who->box.empty()) {
    return Usage("who asks about one place: give --room ID or --box X0,Y0,Z0,X1,Y1,Z1");
  }
  const auto* to_file = std::get_if<ExportVerb>(&command.verb);
  if (to_file != nullptr && to_file->ply.empty() && to_file->graph_ply.empty() &&
      to_file->gltf.empty()) {
    return Usage("export writes files: give --ply FILE, --graph-ply FILE or --gltf FILE");
  }
  return command;
}

}  // namespace dsg::cli
