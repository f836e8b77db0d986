// SPDX-License-Identifier: Apache-2.0
// The verbs that turn a map into files to look at: export, map.
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/cli/export/floor_choice.h"
#include "query/cli/export/gltf_scene.h"
#include "query/cli/export/ply.h"
#include "query/cli/export/top_view.h"
#include "query/cli/read_content.h"
#include "query/cli/spark_export.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "query/cli/written.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/picture/raster.h"

namespace dsg::cli {
namespace {

absl::StatusOr<ContentAnswer> Read(Session* session, const std::string& at,
                                   ContentOptions options) {
  if (!at.empty()) {
    DSG_ASSIGN_OR_RETURN(options.at_ns, ParseInstant("--at", at, session->map()));
  }
  return ReadContent(*session, &session->api(), options);
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

// Writes the files of one run and remembers what is in them.
class Exporter {
 public:
  Exporter(const MapContent& content, MeshColor color, bool force)
      : content_(content), color_(color), force_(force) {}

  absl::Status WriteMesh(const std::string& path) {
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, force_));
    DSG_RETURN_IF_ERROR(WriteMeshPly(content_, color_, &file));
    const MeshCounts counts = CountMesh(content_.mesh);
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

// Map, revision and instant, as a picture's title.
std::string TitleOf(const Session& session, const ContentAnswer& answer, const MapVerb& verb) {
  std::string title =
      absl::StrCat(answer.content.spec.name, "  revision ", answer.content.revision);
  if (!verb.at.empty()) {
    const auto at_ns = ParseInstant("--at", verb.at, session.map());
    if (at_ns.ok()) absl::StrAppend(&title, "  at ", session.times().Full(*at_ns));
  } else if (answer.last_pose_ns.has_value()) {
    // To the millisecond, which is more than a picture shows.
    constexpr TimeNs kMillisecond = 1'000'000;
    const TimeNs last_ns = *answer.last_pose_ns / kMillisecond * kMillisecond;
    absl::StrAppend(&title, "  up to ", session.times().Full(last_ns));
  }
  if (!verb.floor.empty()) absl::StrAppend(&title, "  floor ", verb.floor);
  return title;
}

}  // namespace

absl::Status RunExport(Session* session, const ExportVerb& verb, std::ostream& out,
                       std::ostream& progress) {
  if (!verb.archive.empty()) return RunExportArchive(session, verb, out, progress);
  DSG_ASSIGN_OR_RETURN(const MeshColor color, ParseColor(verb.color));
  for (const std::string* path : {&verb.ply, &verb.graph_ply, &verb.gltf, &verb.spark}) {
    if (!path->empty()) DSG_RETURN_IF_ERROR(CheckMayWrite(*path, verb.force));
  }
  const bool with_spark = !verb.spark.empty();
  const bool with_mesh = !verb.ply.empty() || !verb.gltf.empty() || with_spark;
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer,
                       Read(session, verb.at, {.with_mesh = with_mesh, .with_poses = with_spark}));
  Exporter exporter(answer.content, color, verb.force);
  if (!verb.ply.empty()) DSG_RETURN_IF_ERROR(exporter.WriteMesh(verb.ply));
  if (!verb.graph_ply.empty()) DSG_RETURN_IF_ERROR(exporter.WriteGraph(verb.graph_ply));
  if (!verb.gltf.empty()) DSG_RETURN_IF_ERROR(exporter.WriteScene(verb.gltf));
  std::vector<Written> files = exporter.files();
  const Revision revision = answer.content.revision;
  if (with_spark) {
    DSG_ASSIGN_OR_RETURN(Written file,
                         WriteSparkExport(std::move(answer.content), verb, &progress));
    files.push_back(std::move(file));
  }
  TellWritten(files, revision, session->common().json, out);
  return absl::OkStatus();
}

absl::Status RunMap(Session* session, const MapVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckMayWrite(verb.png, verb.force));
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer, Read(session, verb.at, {}));
  MapContent& content = answer.content;
  if (!verb.floor.empty()) {
    DSG_ASSIGN_OR_RETURN(const HeightRange floor, ChooseFloor(content, verb.floor));
    KeepFloor(floor, &content);
  }
  const picture::Picture picture =
      DrawTopView(content, {.width_px = verb.width_px, .title = TitleOf(*session, answer, verb)});
  DSG_ASSIGN_OR_RETURN(const std::string png, picture::EncodePng(picture));
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(verb.png, verb.force));
  DSG_RETURN_IF_ERROR(file.Write(png));
  DSG_RETURN_IF_ERROR(file.Commit());
  const Written written{.format = "png",
                        .path = verb.png,
                        .byte_count = file.byte_count(),
                        .counts = {{"columns", picture.width}, {"rows", picture.height}}};
  TellWritten({written}, content.revision, session->common().json, out);
  return absl::OkStatus();
}

}  // namespace dsg::cli
