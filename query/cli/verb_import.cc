// SPDX-License-Identifier: Apache-2.0
// The verb import: a scene-graph file into a map of a store folder.
// Creates nothing before the whole file has been read and understood.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "query/cli/file_text.h"
#include "query/cli/progress.h"
#include "query/cli/table.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/interop/scene_graph_file.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

// Rows of one commit: enough to spread its cost, few enough for its memory.
constexpr size_t kItemsPerCommit = 70'000;
// Counts the ways in which a graph has been cut into parts: an import that another program began is
// not gone on with by parts that are not its own.
constexpr char kSessionPrefix[] = "import-2-";
// 2000-01-01: no log of a clock that counts from the start of a machine reaches it.
constexpr TimeNs kFirstUnixNs = 946'684'800 * kNsPerSecond;

bool IsMissing(const absl::Status& status) { return ReasonOf(status) == Reason::kMapUnknown; }

// The spec of a map that is there already; nullopt if map or store are still to be made.
absl::StatusOr<std::optional<MapSpec>> FindMap(const std::string& folder, const std::string& name) {
  const auto store = OpenStore(folder, {});
  if (!store.ok()) {
    if (IsMissing(store.status())) return std::optional<MapSpec>();
    return store.status();
  }
  const auto map = (*store)->OpenMap(name);
  if (!map.ok()) {
    if (IsMissing(map.status())) return std::optional<MapSpec>();
    return map.status();
  }
  return std::optional<MapSpec>((*map)->spec());
}

MapSpec SpecOfNewMap(const std::string& name, TimeNs first_ns) {
  MapSpec spec;
  spec.name = name;
  spec.epoch_ns = first_ns;
  spec.clock = first_ns >= kFirstUnixNs ? Clock::kUnix : Clock::kMonotonic;
  return spec;
}

struct Committed {
  Revision last_revision = 0;
  /// Parts that this run added; 0 = all were there.
  int64_t part_count = 0;
};

absl::StatusOr<Committed> CommitAll(GraphWriter* writer, GraphDelta delta, Progress* progress) {
  DSG_ASSIGN_OR_RETURN(const SessionState session, writer->GetSession(delta.session_id));
  Committed committed{.last_revision = session.last_revision};
  const auto commit = [&](GraphDelta part, double done) -> absl::Status {
    const int64_t number = part.sequence;
    // Parts are the same in every run, so what an interrupted one committed is skipped.
    if (number <= session.last_sequence) return absl::OkStatus();
    const auto result = writer->Commit(std::move(part));
    if (!result.ok()) return Annotate(result.status(), absl::StrCat("part ", number));
    committed.last_revision = result->revision;
    ++committed.part_count;
    progress->Update(done);
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(ForEachPart(std::move(delta), kItemsPerCommit, commit));
  return committed;
}

absl::StatusOr<Committed> CommitToStore(const CommonOptions& common, bool map_exists,
                                        TimeNs first_ns, GraphDelta delta, Progress* progress) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(common.store, {.create = true, .program = "dsg import"}));
  if (!map_exists) DSG_RETURN_IF_ERROR(store->CreateMap(SpecOfNewMap(common.map, first_ns)));
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphWriter> writer, store->OpenWriter(common.map));
  const auto committed = CommitAll(writer.get(), std::move(delta), progress);
  const Reason reason = ReasonOf(committed.status());
  if (!map_exists || (reason != Reason::kDeltaInvalid && reason != Reason::kTrackConflict)) {
    return committed;
  }
  return MakeError(reason,
                   absl::StrCat("map \"", common.map,
                                "\" holds another graph already, and the "
                                "file contradicts it (",
                                std::string(committed.status().message()),
                                "); `dsg-ingest` lays a newer file of the same building over an "
                                "older one, or import into another --map"),
                   MetadataOf(committed.status()));
}

// To the error output, so that a script's answer stays what it is.
void TellSkipped(const ImportedGraph& graph, std::ostream& out) {
  for (const Skipped& skipped : graph.skipped)
    out << "note: " << Printable(ToString(skipped)) << "\n";
}

nlohmann::ordered_json SkippedToJson(const std::vector<Skipped>& all) {
  auto json = nlohmann::ordered_json::array();
  for (const Skipped& skipped : all) {
    json.push_back({{"what", skipped.what},
                    {"count", std::to_string(skipped.count)},
                    {"first", skipped.first}});
  }
  return json;
}

void PrintJson(const ImportedGraph& graph, const std::string& file, const std::string& map,
               const Committed& committed, std::ostream& out) {
  const nlohmann::ordered_json json = {
      {"file", file},
      {"format", graph.format},
      {"map", map},
      {"revision", std::to_string(committed.last_revision)},
      {"added", committed.part_count > 0},
      {"node_count", std::to_string(graph.node_count)},
      {"edge_count", std::to_string(graph.edge_count)},
      {"pose_count", std::to_string(graph.pose_count)},
      {"mesh_vertex_count", std::to_string(graph.mesh_vertex_count)},
      {"mesh_face_count", std::to_string(graph.mesh_face_count)},
      {"notes", graph.notes},
      {"skipped", SkippedToJson(graph.skipped)}};
  out << json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
}

void PrintSummary(const ImportedGraph& graph, const std::string& file, const std::string& map,
                  const Committed& committed, std::ostream& out) {
  const std::string what = absl::StrCat(graph.node_count, " nodes, ", graph.edge_count, " edges, ",
                                        graph.pose_count, " poses, ", graph.mesh_vertex_count,
                                        " mesh vertices, ", graph.mesh_face_count, " mesh faces");
  for (const std::string& note : graph.notes) out << "note: " << Printable(note) << "\n";
  if (committed.part_count == 0) {
    out << Printable(file) << " (" << graph.format << ": " << what << ") is already in map " << map
        << "; nothing added, revision " << committed.last_revision << "\n";
    return;
  }
  out << "imported " << Printable(file) << " (" << graph.format << ") into map " << map << ": "
      << what << "; revision " << committed.last_revision << "\n";
}

}  // namespace

absl::Status RunImport(const CommonOptions& common, const ImportVerb& verb, std::ostream& out,
                       std::ostream& progress_out) {
  if (IsArchivePath(verb.file)) {
    return RunRestore(common, {.path = verb.file, .as = common.map}, out, progress_out);
  }
  DSG_RETURN_IF_ERROR(CheckMapName(common.map));
  Progress progress("import", &progress_out);
  DSG_ASSIGN_OR_RETURN(const FileText file, FileText::Read(verb.file));
  DSG_ASSIGN_OR_RETURN(const std::optional<MapSpec> found, FindMap(common.store, common.map));
  const std::string name = std::filesystem::path(verb.file).filename().string();
  // Before the text is read, and leaves memory.
  ContentDigest content;
  content.Add(file.text());
  const ReadOptions options = {.is_strict = verb.is_strict,
                               .passed = [&file](std::string_view text) { file.Drop(text); }};
  DSG_ASSIGN_OR_RETURN(
      ImportedGraph graph,
      ReadSceneGraph(file.text(), name, found.value_or(MapSpec()).mesh_block_size_m, options));
  TellSkipped(graph, progress_out);
  GraphDelta delta = std::move(graph.delta);
  delta.map = common.map;
  delta.session_id = kSessionPrefix + absl::BytesToHexString(content.bytes());
  delta.sequence = 1;
  delta.author = "dsg import";
  delta.message = absl::StrCat("import of ", name, " (", graph.format, ")");
  DSG_ASSIGN_OR_RETURN(
      const Committed committed,
      CommitToStore(common, found.has_value(), graph.first_ns, std::move(delta), &progress));
  const auto print = common.json ? PrintJson : PrintSummary;
  print(graph, verb.file, common.map, committed, out);
  return absl::OkStatus();
}

}  // namespace dsg::cli
