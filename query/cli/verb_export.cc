// SPDX-License-Identifier: Apache-2.0
// The verbs that write a map to files: export, map.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/answer_picture.h"
#include "query/cli/export/exploded_view.h"
#include "query/cli/export/gltf_scene.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/mesh_file.h"
#include "query/cli/export/sdf_world.h"
#include "query/cli/export/top_view.h"
#include "query/cli/json.h"
#include "query/cli/progress.h"
#include "query/cli/read_content.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "query/cli/verbs_backup.h"
#include "schema/archive/archive_file.h"
#include "schema/archive/archive_map.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/interop/map_to_spark.h"
#include "schema/interop/spark_writer.h"
#include "schema/picture/raster.h"

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

struct MapVerb {
  std::string png;
  /// A level or room by id or name, or a height; empty = all floors.
  std::string floor;
  /// The layers one above the other, instead of the map from above.
  bool is_exploded = false;
  /// The mesh alone, seen obliquely.
  bool is_mesh = false;
  /// A second map whose mesh is drawn at the right of it; empty = none.
  std::string beside;
  bool with_bodies = false;
  int width_px = 1600;
  std::string at;
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
std::optional<SparkForm> SparkFormOf(const std::string& path) {
  if (path.ends_with(".json")) return SparkForm::kJson;
  if (path.ends_with(".sparkdsg") || path.ends_with(".bin")) return SparkForm::kBinary;
  return std::nullopt;
}

// Of all files that can be written in one run, those that are.
std::vector<std::string> PathsOf(const ExportVerb& verb) {
  std::vector<std::string> paths = {verb.ply, verb.graph_ply, verb.gltf, verb.spark, verb.sdf};
  std::erase(paths, "");
  return paths;
}

// `content` has poses and mesh; notes and progress go to `progress_out`.
absl::StatusOr<Written> WriteSparkExport(MapContent content, const ExportVerb& verb,
                                         std::ostream* progress_out) {
  Progress progress("export to Spark-DSG", progress_out);
  const SparkForm form = SparkFormOf(verb.spark).value_or(SparkForm::kJson);
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
  if (common.revision.has_value() || !common.tag.empty() || !verb.at.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     "an archive has all revisions and all times; remove --revision and --at",
                     {{"field", "--revision"}});
  }
  if (PathsOf(verb).empty()) return absl::OkStatus();
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

absl::StatusOr<ContentAnswer> ReadMapAt(Session* session, const std::string& at,
                                        ContentOptions options) {
  if (!at.empty()) {
    DSG_ASSIGN_OR_RETURN(options.at_ns, ParseInstant("--at", at, session->map()));
  }
  return ReadContent(session, options);
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

std::string NameAndRevision(const MapContent& content) {
  return absl::StrCat(content.spec.name, "  revision ", content.revision);
}

// The title of the picture: map, revision and instant.
std::string TitleOf(const Session& session, const ContentAnswer& answer, const MapVerb& verb) {
  std::string title = NameAndRevision(answer.content);
  if (!verb.at.empty()) {
    const auto at_ns = ParseInstant("--at", verb.at, session.map());
    if (at_ns.ok()) absl::StrAppend(&title, "  at ", session.times().Full(*at_ns));
  } else if (answer.last_pose_ns.has_value()) {
    // A millisecond is finer than the picture.
    constexpr TimeNs kMillisecond = 1'000'000;
    const TimeNs last_ns = *answer.last_pose_ns / kMillisecond * kMillisecond;
    absl::StrAppend(&title, "  up to ", session.times().Full(last_ns));
  }
  if (!verb.floor.empty()) absl::StrAppend(&title, "  floor ", verb.floor);
  return title;
}

absl::Status RunExport(Session* session, const ExportVerb& verb, std::ostream& out) {
  if (!verb.archive.empty()) return WriteArchive(session, verb, out);
  DSG_ASSIGN_OR_RETURN(const MeshColor color, ParseColor(verb.color));
  for (const std::string& path : PathsOf(verb)) {
    DSG_RETURN_IF_ERROR(CheckMayWrite(path, verb.force));
  }
  const bool with_spark = !verb.spark.empty();
  const bool with_sdf = !verb.sdf.empty();
  if (with_sdf) DSG_RETURN_IF_ERROR(CheckMayWrite(MeshPathOf(verb.sdf), verb.force));
  const bool with_mesh = !verb.ply.empty() || !verb.gltf.empty() || with_spark || with_sdf;
  DSG_ASSIGN_OR_RETURN(
      ContentAnswer answer,
      ReadMapAt(session, verb.at,
                {.with_mesh = with_mesh,
                 .mesh_node = verb.node,
                 .with_bodies = verb.with_bodies,
                 .body_step_ns = static_cast<TimeNs>(std::llround(verb.body_step_s * kNsPerSecond)),
                 .body_count_max = verb.body_count_max,
                 .with_poses = with_spark}));
  if (verb.with_bodies && answer.content.bodies.empty()) {
    session->notes() << "note: no agent has a body with faces and a pose then\n";
  }
  if (!verb.node.empty() && CountMesh(answer.content.mesh).faces == 0) {
    session->notes() << "note: the mesh has no triangles of " << Printable(verb.node) << "\n";
  }
  Exporter exporter(answer.content, color, verb.force);
  if (!verb.ply.empty()) DSG_RETURN_IF_ERROR(exporter.WriteMesh(verb.ply));
  if (!verb.graph_ply.empty()) DSG_RETURN_IF_ERROR(exporter.WriteGraph(verb.graph_ply));
  if (!verb.gltf.empty()) DSG_RETURN_IF_ERROR(exporter.WriteScene(verb.gltf));
  if (with_sdf) {
    SdfOptions options = verb.sdf_options;
    options.with_agents = !verb.at.empty();
    DSG_RETURN_IF_ERROR(exporter.WriteSdf(verb.sdf, std::move(options)));
  }
  std::vector<Written> files = exporter.files();
  const Revision revision = answer.content.revision;
  if (with_spark) {
    DSG_ASSIGN_OR_RETURN(Written file,
                         WriteSparkExport(std::move(answer.content), verb, &session->notes()));
    files.push_back(std::move(file));
  }
  TellWritten(files, revision, session->common().json, out);
  return absl::OkStatus();
}

// The newest content of another map of the same store or server.
absl::StatusOr<MapContent> ReadBeside(const Session& session, const MapVerb& verb) {
  CommonOptions common = session.common();
  common.map = verb.beside;
  common.revision.reset();
  common.tag.clear();
  Session other(std::move(common), session.program_version(), &session.notes());
  DSG_RETURN_IF_ERROR(other.Open());
  DSG_RETURN_IF_ERROR(other.ChooseMap());
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer, ReadMapAt(&other, verb.at, {}));
  return std::move(answer.content);
}

absl::StatusOr<picture::Picture> DrawMap(Session* session, const MapVerb& verb,
                                         const MapContent& content, const std::string& title) {
  if (verb.is_exploded) {
    return DrawExplodedView(content, {.width_px = verb.width_px, .title = title});
  }
  if (!verb.is_mesh) return DrawTopView(content, {.width_px = verb.width_px, .title = title});
  if (verb.beside.empty()) return DrawMeshes({{content, title}}, verb.width_px);
  DSG_ASSIGN_OR_RETURN(const MapContent other, ReadBeside(*session, verb));
  return DrawMeshes({{content, NameAndRevision(content)}, {other, NameAndRevision(other)}},
                    verb.width_px);
}

absl::Status RunMap(Session* session, const MapVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckMayWrite(verb.png, verb.force));
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer,
                       ReadMapAt(session, verb.at, {.with_bodies = verb.with_bodies}));
  MapContent& content = answer.content;
  if (!verb.floor.empty()) {
    DSG_ASSIGN_OR_RETURN(const HeightRange floor, ChooseFloor(content, verb.floor));
    KeepFloor(floor, &content);
  }
  DSG_ASSIGN_OR_RETURN(const picture::Picture picture,
                       DrawMap(session, verb, content, TitleOf(*session, answer, verb)));
  DSG_ASSIGN_OR_RETURN(const Written written, WritePng(picture, verb.png, verb.force));
  TellWritten({written}, content.revision, session->common().json, out);
  return absl::OkStatus();
}

constexpr char kContentAtHelp[] = "The world at this TIME; default all that has not ended";

absl::Status CheckExport(const ExportVerb& verb, const CommonOptions& common) {
  const bool is_mesh_alone = verb.archive.empty() && !verb.ply.empty() && PathsOf(verb).size() == 1;
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
  if (!verb.spark.empty() && !SparkFormOf(verb.spark).has_value()) {
    return Usage(absl::StrCat("--spark \"", verb.spark,
                              "\": end the name in .json, or in .sparkdsg or .bin for the binary "
                              "form"),
                 "export");
  }
  if (!verb.sdf.empty() && !verb.sdf.ends_with(".sdf")) {
    return Usage(absl::StrCat("--sdf \"", verb.sdf, "\": end the name in .sdf"), "export");
  }
  if (!PathsOf(verb).empty()) return absl::OkStatus();
  return Usage(
      "export writes files: give FILE.dsgz, --ply FILE, --graph-ply FILE, --gltf FILE, --spark "
      "FILE or --sdf FILE",
      "export");
}

void AddExport(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ExportVerb>({.name = "export",
                                .what = "Write mesh and graph to files, or an archive of the map",
                                .example = "--gltf office.glb",
                                .run = RunExport,
                                .check = CheckExport});
  app->add_option("FILE", verb->archive, "Archive of the whole map with its history, FILE.dsgz");
  app->add_flag("--rows", verb->with_rows,
                "An archive of rows, which programs with another store or a newer format read too");
  app->add_option("--ply", verb->ply, "The mesh, binary PLY");
  app->add_option("--graph-ply", verb->graph_ply, "The graph, PLY of points and lines");
  app->add_option("--gltf", verb->gltf, "Mesh and graph, binary glTF 2.0 (.glb)");
  app->add_option("--spark", verb->spark, "A Spark-DSG graph, .json, or binary .sparkdsg or .bin");
  app->add_option("--sdf", verb->sdf,
                  "A world of a physics simulator, SDFormat .sdf, and its mesh beside it, .stl");
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

absl::Status CheckMap(const MapVerb& verb, const CommonOptions&) {
  if (!verb.with_bodies || !verb.at.empty()) return absl::OkStatus();
  return Usage("a picture shows one instant: give --at with --bodies", "map");
}

void AddMap(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<MapVerb>({.name = "map",
                                                  .what = "Draw a map from above",
                                                  .example = "--png office.png",
                                                  .run = RunMap,
                                                  .check = CheckMap});
  app->add_option("--png", verb->png, "The picture to write")->required();
  app->add_option("--floor", verb->floor, kFloorHelp);
  CLI::Option* exploded =
      app->add_flag("--exploded", verb->is_exploded, "Layers one above the other, seen obliquely");
  CLI::Option* mesh =
      app->add_flag("--mesh", verb->is_mesh, "The mesh alone, seen obliquely")->excludes(exploded);
  app->add_option("--beside", verb->beside,
                  "Another map: its mesh at the right, seen from the same place")
      ->needs(mesh);
  app->add_flag("--bodies", verb->with_bodies, "People as bodies, as they are at --at")
      ->excludes(mesh);
  app->add_option("--width", verb->width_px, "Width of the picture, pixels")
      ->check(Between(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str();
  app->add_option("--at", verb->at, kContentAtHelp);
  app->add_flag("--force", verb->force, "Replace an existing file");
}

}  // namespace

void AddExportVerbs(Grammar* grammar) {
  AddExport(grammar);
  AddMap(grammar);
}

}  // namespace dsg::cli
