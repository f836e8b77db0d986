// SPDX-License-Identifier: Apache-2.0
// The verb export: a map as files.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "query/cli/export/geo_origin.h"
#include "query/cli/export/gltf_scene.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/mesh_file.h"
#include "query/cli/export/sdf_world.h"
#include "query/cli/export_csv.h"
#include "query/cli/export_geojson.h"
#include "query/cli/export_tum.h"
#include "query/cli/json.h"
#include "query/cli/map_rows.h"
#include "query/cli/progress.h"
#include "query/cli/read_content.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "query/cli/verbs_backup.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/interop/map_to_spark.h"
#include "schema/interop/spark_writer.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

struct ExportVerb {
  /// An archive of all of the map (.dsgz).
  std::string archive;
  /// The archive holds rows, which every backend reads, instead of a database.
  bool with_rows = false;
  /// Files to write; at least one is set, or `archive` is.
  std::string ply;
  std::string graph_ply;
  std::string gltf;
  /// Spark-DSG, JSON or binary by its ending.
  std::string spark;
  /// Distance between its poses, metres; 0 = all poses.
  double pose_step_m = 0.5;
  /// A world of a physics simulator; its mesh goes beside it, as .stl.
  std::string sdf;
  SdfOptions sdf_options{};
  /// Tracks: a folder for one file an agent.
  std::string tum;
  /// Tables: a folder.
  std::string csv;
  /// Places on the Earth, with where the map lies there.
  std::string geojson;
  std::string origin;
  /// People as bodies: walking in a glTF scene, standing at `at`.
  bool with_bodies = false;
  double body_step_s = 0.25;
  int64_t body_count_max = 2000;
  /// "rgb", "label", "instance"; empty = rgb if the mesh has it, else label.
  std::string color;
  std::string at;
  /// Of the mesh only what is this node's; empty = all of it.
  std::string node;
  bool force = false;
};

// Rough share of the conversion in the total time.
constexpr double kConverted = 0.6;

MapContents ContentsOf(MapContent content) {
  MapContents map;
  map.spec = std::move(content.spec);
  map.revision = content.revision;
  map.layers = std::move(content.layers);
  map.nodes = std::move(content.nodes);
  map.edges = std::move(content.edges);
  map.mesh = std::move(content.mesh);
  for (Track& track : content.tracks) map.tracks.push_back({track.agent, std::move(track.poses)});
  return map;
}

// By the ending of the name: .json; .sparkdsg or .bin.
SparkForm SparkFormOf(const std::string& path) {
  return absl::EndsWithIgnoreCase(path, ".json") ? SparkForm::kJson : SparkForm::kBinary;
}

// The files that are made of the whole content, held in memory.
std::vector<std::string> ContentPaths(const ExportVerb& verb) {
  std::vector<std::string> paths = {verb.ply, verb.graph_ply, verb.gltf, verb.spark, verb.sdf};
  std::erase(paths, "");
  return paths;
}

// The files and folders that are written while the map is read.
std::vector<std::string> RowPaths(const ExportVerb& verb) {
  std::vector<std::string> paths = {verb.tum, verb.csv, verb.geojson};
  std::erase(paths, "");
  return paths;
}

// `content` has poses and mesh; notes and progress go to `progress_out`.
absl::StatusOr<Written> WriteSparkExport(MapContent content, const ExportVerb& verb,
                                         std::ostream* progress_out) {
  Progress progress("export to Spark-DSG", progress_out);
  const SparkForm form = SparkFormOf(verb.spark);
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(verb.spark, verb.force));
  DSG_ASSIGN_OR_RETURN(const SparkExport made, MapToSpark(ContentsOf(std::move(content)),
                                                          {.distance_m = verb.pose_step_m}));
  progress.Update(kConverted);
  DSG_RETURN_IF_ERROR(
      WriteSpark(made.graph, form, [&file](std::string_view bytes) { return file.Write(bytes); }));
  DSG_RETURN_IF_ERROR(file.Commit());
  for (const std::string& note : made.notes) *progress_out << "note: " << Printable(note) << "\n";
  const MeshBlock mesh = made.graph.mesh.value_or(MeshBlock());
  return Written{.format = form == SparkForm::kJson ? "spark-json" : "spark-binary",
                 .path = verb.spark,
                 .byte_count = file.byte_count(),
                 .counts = {{"nodes", static_cast<int64_t>(made.graph.nodes.size())},
                            {"edges", static_cast<int64_t>(made.graph.edges.size())},
                            {"poses", made.pose_count},
                            {"vertices", static_cast<int64_t>(mesh.positions_map.size())},
                            {"faces", static_cast<int64_t>(mesh.faces.size())}}};
}

absl::Status CheckAlone(const Session& session, const ExportVerb& verb) {
  const CommonOptions& common = session.common();
  if (common.at.is_set() || !verb.at.empty()) {
    return MakeError(
        Reason::kFieldInvalid,
        "an archive has all revisions and all times; remove --revision, --as-of and --at",
        {{"field", "--revision"}});
  }
  if (ContentPaths(verb).empty() && RowPaths(verb).empty()) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      "an archive is the only file of its call; export the other files in another call",
      {{"field", "FILE"}});
}

// Gives the archive of a map of the local store to `write`, piece by piece.
absl::Status CopyRows(const std::string& folder, const std::string& map, const StopCheck& stop,
                      const std::function<absl::Status(std::string_view)>& write,
                      const dsg::Progress& progress) {
  DSG_ASSIGN_OR_RETURN(const auto store, OpenStore(folder, {.program = "dsg export"}));
  DSG_ASSIGN_OR_RETURN(const auto reader, store->OpenMap(map));
  DSG_ASSIGN_OR_RETURN(const auto encoder, ArchiveRows(reader.get(), store->folder(), stop));
  while (!encoder->done()) {
    DSG_ASSIGN_OR_RETURN(const std::string piece, encoder->Next(stop));
    DSG_RETURN_IF_ERROR(write(piece));
    progress(encoder->progress());
  }
  return absl::OkStatus();
}

absl::Status WriteArchive(Session* session, const ExportVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckAlone(*session, verb));
  DSG_RETURN_IF_ERROR(CheckMayWrite(verb.archive, verb.force));
  const std::string& map = session->map().name;
  Progress progress(absl::StrCat("export ", map), &session->notes());
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(verb.archive));
  const auto write = [&](std::string_view bytes) { return file.Write(bytes); };
  const auto tell = [&](double fraction) { progress.Update(fraction); };
  DSG_RETURN_IF_ERROR(verb.with_rows
                          ? CopyRows(session->common().store, map, call.stop(), write, tell)
                          : CopyArchive(session, map, call, write, tell));
  DSG_RETURN_IF_ERROR(file.Commit());
  // The archive may come over a network, so it is verified.
  const auto manifest = ReadArchiveFile(verb.archive, nullptr, call.stop(), nullptr);
  if (!manifest.ok()) {
    std::remove(verb.archive.c_str());
    return manifest.status();
  }
  const Written written{
      .format = "dsgz",
      .path = verb.archive,
      .byte_count = file.byte_count(),
      .counts = {{verb.with_rows ? "row bytes" : "database bytes", manifest->database_bytes}}};
  TellWritten({written}, manifest->newest_revision, session->common().json, out);
  return absl::OkStatus();
}

absl::StatusOr<MeshColor> ParseColor(const std::string& text) {
  if (text.empty()) return MeshColor::kAuto;
  if (text == "rgb") return MeshColor::kRgb;
  if (text == "label") return MeshColor::kLabel;
  if (text == "instance") return MeshColor::kInstance;
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--color \"", text, "\": give rgb, label or instance"),
                   {{"field", "--color"}, {"value", text}});
}

// "office.stl" of "office.sdf".
std::string MeshPathOf(const std::string& sdf_path) {
  return std::filesystem::path(sdf_path).replace_extension(".stl").string();
}

// Writes the files of one run and counts what is in them.
class Exporter {
 public:
  Exporter(const MapContent& content, MeshColor color, bool force)
      : content_(content), color_(color), force_(force) {}

  absl::Status WriteMesh(const std::string& path) {
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force_));
    DSG_RETURN_IF_ERROR(WriteMeshPly(content_, color_, &file));
    MeshCounts counts = CountMesh(content_.mesh);
    for (const AgentBodies& agent : content_.bodies) {
      for (const Body& body : agent.bodies) {
        counts.vertices += body.points_map.size();
        counts.faces += body.face_count();
      }
    }
    return Finish("ply", {{"vertices", counts.vertices}, {"faces", counts.faces}}, &file);
  }

  absl::Status WriteGraph(const std::string& path) {
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force_));
    DSG_ASSIGN_OR_RETURN(const GraphPlyCounts counts, WriteGraphPly(content_, &file));
    return Finish("ply", {{"vertices", counts.vertices}, {"edges", counts.edges}}, &file);
  }

  absl::Status WriteScene(const std::string& path) {
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force_));
    const GltfDocument document = MakeGltf(content_, color_);
    DSG_RETURN_IF_ERROR(document.Write(&file));
    const MeshCounts counts = CountMesh(content_.mesh);
    return Finish("glb", {{"nodes", document.nodes.size()}, {"faces", counts.faces}}, &file);
  }

  /// The mesh first: a world whose mesh is missing does not load.
  absl::Status WriteSdf(const std::string& path, SdfOptions options) {
    const std::string mesh_path = MeshPathOf(path);
    options.mesh_uri = std::filesystem::path(mesh_path).filename().string();
    const SdfWorld world = MakeSdf(content_, options);
    if (!world.stl.empty()) {
      DSG_ASSIGN_OR_RETURN(AtomicFile mesh, AtomicFile::Create(mesh_path, force_));
      DSG_RETURN_IF_ERROR(mesh.Write(world.stl));
      DSG_RETURN_IF_ERROR(Finish("stl", {{"faces", world.face_count}}, &mesh));
    }
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force_));
    DSG_RETURN_IF_ERROR(file.Write(world.xml));
    return Finish("sdf",
                  {{"floors", world.floor_count},
                   {"structures", world.wall_count},
                   {"objects", world.object_count},
                   {"movable", world.movable_count},
                   {"agents", world.agent_count}},
                  &file);
  }

  const std::vector<Written>& files() const { return files_; }

 private:
  absl::Status Finish(const std::string& format,
                      const std::vector<std::pair<std::string, size_t>>& counts, AtomicFile* file) {
    DSG_RETURN_IF_ERROR(file->Commit());
    Written written{.format = format, .path = file->path(), .byte_count = file->byte_count()};
    for (const auto& [what, count] : counts) {
      written.counts.emplace_back(what, static_cast<int64_t>(count));
    }
    files_.push_back(std::move(written));
    return absl::OkStatus();
  }

  const MapContent& content_;
  const MeshColor color_;
  const bool force_;
  std::vector<Written> files_;
};

// A file without content would not say why it is empty.
void NoteEmptyMesh(const MapContent& content, const ExportVerb& verb, std::ostream& notes) {
  if (!verb.node.empty()) {
    if (CountMesh(content.mesh).faces > 0) return;
    notes << "note: the mesh has no triangles of " << Printable(verb.node) << "\n";
  } else if (!verb.ply.empty() && CountMesh(content.mesh).vertices == 0 && content.bodies.empty()) {
    notes << "note: map " << content.spec.name << " has no mesh at revision " << content.revision
          << ", so " << verb.ply << " has no vertices\n";
  }
}

absl::Status ExportContent(Session* session, const ExportVerb& verb, Revision revision,
                           std::vector<Written>* files) {
  DSG_ASSIGN_OR_RETURN(const MeshColor color, ParseColor(verb.color));
  const bool with_spark = !verb.spark.empty();
  const bool with_sdf = !verb.sdf.empty();
  if (with_sdf) DSG_RETURN_IF_ERROR(CheckMayWrite(MeshPathOf(verb.sdf), verb.force));
  const bool with_mesh = !verb.ply.empty() || !verb.gltf.empty() || with_spark || with_sdf;
  DSG_ASSIGN_OR_RETURN(
      ContentAnswer answer,
      ReadContentAt(
          session, verb.at,
          {.with_mesh = with_mesh,
           .mesh_node = verb.node,
           .with_bodies = verb.with_bodies,
           .body_step_ns = static_cast<TimeNs>(std::llround(verb.body_step_s * kNsPerSecond)),
           .body_count_max = verb.body_count_max,
           .with_poses = with_spark,
           .revision = revision}));
  NoteEmptyMesh(answer.content, verb, session->notes());
  Exporter exporter(answer.content, color, verb.force);
  if (!verb.ply.empty()) DSG_RETURN_IF_ERROR(exporter.WriteMesh(verb.ply));
  if (!verb.graph_ply.empty()) DSG_RETURN_IF_ERROR(exporter.WriteGraph(verb.graph_ply));
  if (!verb.gltf.empty()) DSG_RETURN_IF_ERROR(exporter.WriteScene(verb.gltf));
  if (with_sdf) {
    SdfOptions options = verb.sdf_options;
    options.with_agents = !verb.at.empty();
    DSG_RETURN_IF_ERROR(exporter.WriteSdf(verb.sdf, std::move(options)));
  }
  *files = exporter.files();
  if (!with_spark) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(Written file,
                       WriteSparkExport(std::move(answer.content), verb, &session->notes()));
  files->push_back(std::move(file));
  return absl::OkStatus();
}

absl::Status ExportRows(const MapRows& map, const ExportVerb& verb, std::vector<Written>* files) {
  if (!verb.geojson.empty()) {
    DSG_ASSIGN_OR_RETURN(const GeoOrigin origin, ParseOrigin(verb.origin));
    DSG_ASSIGN_OR_RETURN(Written file, WriteGeoJson(map, origin, verb.geojson, verb.force));
    files->push_back(std::move(file));
  }
  if (!verb.tum.empty()) {
    DSG_ASSIGN_OR_RETURN(const auto tracks, WriteTumFiles(map, verb.tum, verb.force));
    if (tracks.empty()) map.session().notes() << "note: no agent has a pose; no track is written\n";
    files->insert(files->end(), tracks.begin(), tracks.end());
  }
  if (!verb.csv.empty()) {
    DSG_ASSIGN_OR_RETURN(const auto tables, WriteCsvTables(map, verb.csv, verb.force));
    files->insert(files->end(), tables.begin(), tables.end());
  }
  return absl::OkStatus();
}

absl::Status RunExport(Session* session, const ExportVerb& verb, std::ostream& out) {
  if (!verb.archive.empty()) return WriteArchive(session, verb, out);
  for (const std::string& path : ContentPaths(verb)) {
    DSG_RETURN_IF_ERROR(CheckMayWrite(path, verb.force));
  }
  std::optional<TimeNs> at_ns;
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(at_ns, ParseInstant("--at", verb.at, session->map()));
  }
  // All files of a run have one revision.
  DSG_ASSIGN_OR_RETURN(const MapRows map, MapRows::Open(session, at_ns));
  std::vector<Written> files;
  if (!ContentPaths(verb).empty()) {
    DSG_RETURN_IF_ERROR(ExportContent(session, verb, map.revision(), &files));
  }
  DSG_RETURN_IF_ERROR(ExportRows(map, verb, &files));
  TellWritten(files, map.revision(), session->common().json, out);
  return absl::OkStatus();
}

absl::Status CheckExport(const ExportVerb& verb, const CommonOptions& common) {
  const bool is_mesh_alone = verb.archive.empty() && !verb.ply.empty() &&
                             ContentPaths(verb).size() == 1 && RowPaths(verb).empty();
  if (!verb.node.empty() && !is_mesh_alone) {
    return Usage("--node is of the mesh: give --ply FILE, and no other file", "export");
  }
  if (verb.with_bodies && verb.ply.empty() && verb.gltf.empty()) {
    return Usage("--bodies go into --gltf FILE, or with --at into --ply FILE", "export");
  }
  if (verb.with_bodies && !verb.ply.empty() && verb.at.empty()) {
    return Usage("a PLY file shows one instant: give --at with --bodies", "export");
  }
  if (verb.with_rows && verb.archive.empty()) {
    return Usage("--rows is of an archive: give FILE.dsgz", "export");
  }
  if (verb.with_rows && common.store.empty()) {
    return Usage(
        "--rows reads a store folder: give --store DIR, or export through the server "
        "without --rows, restore that archive and export it from there",
        "export");
  }
  if (!verb.archive.empty()) {
    if (IsArchivePath(verb.archive)) return absl::OkStatus();
    return Usage(
        absl::StrCat("\"", verb.archive, "\" does not end in .dsgz; other formats have options"),
        "export");
  }
  if (!verb.geojson.empty() && verb.origin.empty()) {
    return Usage(
        "GeoJSON is in degrees: say where the map lies with --origin LAT,LON,HEADING (WGS84 of its "
        "origin, and the compass direction of its x axis)",
        "export");
  }
  if (!verb.origin.empty()) DSG_RETURN_IF_ERROR(ParseOrigin(verb.origin).status());
  if (!ContentPaths(verb).empty() || !RowPaths(verb).empty()) return absl::OkStatus();
  return Usage(
      "export writes files: give FILE.dsgz, --ply FILE, --graph-ply FILE, --gltf FILE, --spark "
      "FILE, --sdf FILE, --tum DIR, --csv DIR or --geojson FILE",
      "export");
}

}  // namespace

void AddExportVerb(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ExportVerb>({.name = "export",
                                .what = "Write a map to files, or an archive of it",
                                .example = "--gltf office.glb",
                                .run = RunExport,
                                .check = CheckExport});
  app->add_option("FILE", verb->archive, "Archive of the whole map with its history, FILE.dsgz");
  app->add_flag("--rows", verb->with_rows,
                "An archive of rows, which programs with another store or a newer format read too");
  app->add_option("--ply", verb->ply, "The mesh, binary PLY")->check(EndsIn({".ply"}));
  app->add_option("--graph-ply", verb->graph_ply, "The graph, PLY of points and lines")
      ->check(EndsIn({".ply"}));
  app->add_option("--gltf", verb->gltf, "Mesh and graph, binary glTF 2.0")->check(EndsIn({".glb"}));
  app->add_option("--spark", verb->spark, "A Spark-DSG graph, .json, or binary .sparkdsg or .bin")
      ->check(EndsIn({".json", ".sparkdsg", ".bin"}));
  app->add_option("--sdf", verb->sdf,
                  "A world of a physics simulator, SDFormat, and its mesh beside it, .stl")
      ->check(EndsIn({".sdf"}));
  app->add_option("--tum", verb->tum,
                  "Tracks, to this folder: NAME.tum an agent, timestamp tx ty tz qx qy qz qw");
  app->add_option("--csv", verb->csv, "Nodes, edges, tracks and stays as tables, to this folder");
  CLI::Option* geojson =
      app->add_option("--geojson", verb->geojson, "Rooms, objects, places and tracks on the Earth")
          ->check(EndsIn({".geojson", ".json"}));
  app->add_option("--origin", verb->origin,
                  "LAT,LON,HEADING: WGS84 degrees of the map's origin, and the compass direction "
                  "of its x axis (0 north, 90 east), for --geojson")
      ->needs(geojson);
  app->add_option("--movable-size", verb->sdf_options.movable_size_m,
                  "Longest edge of the objects that move in --sdf, metres; 0 = all are fixed")
      ->check(ZeroOrMore())
      ->capture_default_str();
  app->add_option("--density", verb->sdf_options.density_kg_m3,
                  "Mass of the boxes of objects in --sdf, kg a cubic metre")
      ->check(Between(0.001, 1e5))
      ->capture_default_str();
  app->add_option("--pose-step", verb->pose_step_m,
                  "Distance between the poses that --spark writes, metres; 0 = all poses")
      ->check(ZeroOrMore())
      ->capture_default_str();
  app->add_flag("--bodies", verb->with_bodies,
                "People as bodies: walking in --gltf, or as they are at --at in --gltf and --ply");
  app->add_option("--body-step", verb->body_step_s,
                  "Least time between two bodies of one that walks, seconds; 0 = all")
      ->check(ZeroOrMore())
      ->capture_default_str();
  app->add_option("--body-max", verb->body_count_max,
                  "Refuse more bodies in all; each is 12 bytes a vertex of the file")
      ->check(Between(1, 1'000'000))
      ->capture_default_str();
  app->add_option(
         "--color", verb->color,
         "Mesh colours: rgb, label or instance; default rgb if the mesh has it, else label")
      ->check(CLI::IsMember({"rgb", "label", "instance"}));
  app->add_option("--node", verb->node,
                  "Of the mesh only what is this object's, structure's, room's or region's (id or "
                  "unique name); with --ply");
  app->add_option("--at", verb->at, kContentAtHelp);
  app->add_flag("--force", verb->force, "Replace existing files");
}

}  // namespace dsg::cli
