// SPDX-License-Identifier: Apache-2.0
// The grammar of the verbs about maps as a whole, their revisions and their files.
#include "query/cli/export/top_view.h"
#include "query/cli/grammar.h"
#include "query/cli/number_checks.h"

namespace dsg::cli {
namespace {

void AddExport(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ExportVerb>("export", "Write mesh and graph to files for 3D viewers", kQuestion);
  app->add_option("FILE", verb->archive, "All of the map and its history, FILE.dsgz");
  app->add_option("--ply", verb->ply, "The mesh, binary PLY");
  app->add_option("--graph-ply", verb->graph_ply, "The graph, PLY of points and lines");
  app->add_option("--gltf", verb->gltf, "Mesh and graph, binary glTF 2.0 (.glb)");
  app->add_option("--spark", verb->spark, "A Spark-DSG graph, .json, or binary .sparkdsg or .bin");
  app->add_option("--pose-step", verb->pose_step_m,
                  "Metres between the poses that --spark writes; 0 = every pose")
      ->check(ZeroOrMore())
      ->capture_default_str();
  app->add_option("--color", verb->color,
                  "Mesh colours: rgb, label or instance; default rgb if there are any")
      ->check(CLI::IsMember({"rgb", "label", "instance"}));
  app->add_option("--at", verb->at, "The world at this TIME; default what has not ended");
  app->add_flag("--force", verb->force, "Replace files that are there");
}

void AddMap(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<MapVerb>("map", "Draw a map from above", kQuestion);
  app->add_option("--png", verb->png, "The picture to write")->required();
  app->add_option("--floor", verb->floor, kFloorHelp);
  app->add_option("--width", verb->width_px, "Pixels; the height follows")
      ->check(Between(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str();
  app->add_option("--at", verb->at, "The world at this TIME; default what has not ended");
  app->add_flag("--force", verb->force, "Replace a file that is there");
}

}  // namespace

void AddMapVerbs(Grammar* grammar) {
  grammar->Add<StatsVerb>("stats", "Counts and sizes of a map", kQuestion);
  grammar->Add<MapsVerb>("maps", "List the maps", kServer | kJson);
  grammar->Add<VersionVerb>("version", "Version of this program, and of the server if one is named",
                            kServer | kJson);
}

void AddRevisionVerbs(Grammar* grammar) {
  constexpr unsigned kTakes = kServer | kMap | kJson;
  grammar->Add<LogVerb>("log", "List the revisions of a map, newest first", kTakes | kLimit);

  const auto [diff_app, diff] =
      grammar->Add<DiffVerb>("diff", "What differs between two revisions", kTakes | kLimit);
  AddRevision(diff_app, "FROM", "Revision or tag before", &diff->from)->required();
  AddRevision(diff_app, "TO", "Revision or tag after; default the newest", &diff->to);
  diff_app->add_option("--layer", diff->layer, "Only nodes of this layer, and their edges");

  const auto [watch_app, watch] =
      grammar->Add<WatchVerb>("watch", "Revisions as they come, until Ctrl-C", kTakes);
  AddRevision(watch_app, "--after", "The last revision that is known, or a tag; default the newest",
              &watch->after);
  watch_app->add_flag("--changes", watch->changes, "Also say what changed");
  watch_app->add_option("-n,--count", watch->count, "End after so many revisions")
      ->check(WholeAboveZero());
}

void AddFileVerbs(Grammar* grammar) {
  const auto [app, import] = grammar->Add<ImportVerb>(
      "import", "Add a scene-graph file (Spark-DSG, Kimera) to a map", kMap | kJson);
  app->add_option("FILE", import->file, "The file; a .dsgz is restored")->required();
  app->add_flag("--strict", import->is_strict,
                "Refuse a file with edges to nodes that are not there and the like; without it "
                "they are skipped and counted");
  const auto [verify_app, verify] = grammar->Add<VerifyVerb>(
      "verify", "Check every page, row and revision of a map, an archive or a backup",
      kMap | kJson);
  verify_app->add_option("PATH", verify->path,
                         "A .dsgz file, or the folder of a backup; default the store");
  grammar->Add<UpgradeVerb>("upgrade", "Bring a map to this program's store format", kMap | kJson);
  AddExport(grammar);
  AddMap(grammar);
}

}  // namespace dsg::cli
