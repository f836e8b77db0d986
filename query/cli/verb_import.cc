// SPDX-License-Identifier: Apache-2.0
// The verb import: a scene-graph file into a map of a store folder.
// It changes nothing before it has read the whole file.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "query/cli/progress.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "query/cli/verbs_backup.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/interop/scene_graph_file.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

struct ImportVerb {
  std::string file;
  /// Refuse a file with parts that would be skipped.
  bool is_strict = false;
};

constexpr int64_t kFileBytesMax = int64_t{512} << 20;

// The bytes of a file, in memory that can be freed part by part. Later changes of the file do not
// matter.
class FileText {
 public:
  // Errors: NOT_FOUND without the file; INVALID_ARGUMENT/LIMIT_EXCEEDED beyond 512 MiB;
  // UNAVAILABLE if it cannot be read.
  static absl::StatusOr<FileText> Read(const std::string& path);

  FileText(FileText&& other) noexcept;
  FileText& operator=(FileText&&) = delete;
  ~FileText();

  std::string_view text() const { return {data_, size_}; }
  // Frees the pages of a part of text(), which then read as zeros.
  void Drop(std::string_view part) const;

 private:
  FileText(char* data, size_t size) : data_(data), size_(size) {}

  char* data_ = nullptr;
  size_t size_ = 0;
};

absl::StatusOr<FileText> FileText::Read(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return absl::NotFoundError(absl::StrCat(path, " is not a file; check the path"));
  }
  const uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > static_cast<uintmax_t>(kFileBytesMax)) {
    return MakeError(
        Reason::kLimitExceeded,
        absl::StrCat(path, " has ", size, " bytes; the largest file is ", kFileBytesMax, " bytes"));
  }
  if (size == 0) return FileText(nullptr, 0);
  // The memory of a string can only be freed whole.
  void* const memory =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    return absl::UnavailableError(
        absl::StrCat("there is no memory for the ", size, " bytes of ", path));
  }
  FileText read(static_cast<char*>(memory), size);
  std::ifstream file(path, std::ios::binary);
  if (!file.read(read.data_, static_cast<std::streamsize>(size))) {
    return absl::UnavailableError(absl::StrCat(path, " cannot be read; check its permissions"));
  }
  return read;
}

FileText::FileText(FileText&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

FileText::~FileText() {
  if (data_ != nullptr) munmap(data_, size_);
}

void FileText::Drop(std::string_view part) const {
  static const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  // Pages shared with the neighbouring parts stay.
  const auto offset = static_cast<size_t>(part.data() - data_);
  const size_t begin = (offset + page - 1) / page * page;
  const size_t end = (offset + part.size()) / page * page;
  if (begin < end) madvise(data_ + begin, end - begin, MADV_DONTNEED);
}

// Rows per commit: a trade between the cost of commits and memory.
constexpr size_t kItemsPerCommit = 70'000;
// The number is the version of how a graph is cut into parts. An import that another version began
// is not continued with other parts.
constexpr char kSessionPrefix[] = "import-2-";
// 2000-01-01: clocks that count from the start of a machine do not reach it.
constexpr TimeNs kFirstUnixNs = 946'684'800 * kNsPerSecond;

bool IsMapMissing(const absl::Status& status) { return ReasonOf(status) == Reason::kMapUnknown; }

// The spec of an existing map; nullopt if the map or the store does not exist.
absl::StatusOr<std::optional<MapSpec>> FindMap(const std::string& folder, const std::string& name) {
  const auto store = OpenStore(folder, {});
  if (!store.ok()) {
    if (IsMapMissing(store.status())) return std::optional<MapSpec>();
    return store.status();
  }
  const auto map = (*store)->OpenMap(name);
  if (!map.ok()) {
    if (IsMapMissing(map.status())) return std::optional<MapSpec>();
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
  /// Parts that this run added; 0 = the map had all of them.
  int64_t part_count = 0;
};

absl::StatusOr<Committed> CommitAll(GraphWriter* writer, GraphDelta delta, Progress* progress) {
  DSG_ASSIGN_OR_RETURN(const SessionState session, writer->GetSession(delta.session_id));
  Committed committed{.last_revision = session.last_revision};
  const auto commit = [&](GraphDelta part, double done) -> absl::Status {
    const int64_t number = part.sequence;
    // Every run makes the same parts, so those that an interrupted run committed are skipped.
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

// Removes a map that was made for an import which failed: with all that is in it if the file is
// refused, and would be again; else, as when the disk is full, only if nothing is in it, so that
// the same import goes on.
absl::Status DropAfter(const absl::Status& failure, GraphStore* store, const std::string& map,
                       std::unique_ptr<GraphWriter> writer) {
  MapCondition condition;
  {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, store->OpenMap(map));
    DSG_ASSIGN_OR_RETURN(const RevisionInfo head, reader->Head());
    const Reason reason = ReasonOf(failure);
    const bool is_refused = reason == Reason::kDeltaInvalid || reason == Reason::kTrackConflict;
    if (!is_refused && head.revision > 0) return absl::OkStatus();
    // Nobody else could commit while the writer was open.
    condition = {head.revision, reader->incarnation()};
  }
  writer.reset();
  return store->DropMap(map, condition).status();
}

absl::StatusOr<Committed> CommitToStore(const CommonOptions& common, bool map_exists,
                                        TimeNs first_ns, GraphDelta delta, Progress* progress) {
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphStore> store,
                       OpenStore(common.store, {.create = true, .program = "dsg import"}));
  if (!map_exists) DSG_RETURN_IF_ERROR(store->CreateMap(SpecOfNewMap(common.map, first_ns)));
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphWriter> writer, store->OpenWriter(common.map));
  auto committed = CommitAll(writer.get(), std::move(delta), progress);
  const Reason reason = ReasonOf(committed.status());
  if (!map_exists && !committed.ok()) {
    const absl::Status dropped =
        DropAfter(committed.status(), store.get(), common.map, std::move(writer));
    if (dropped.ok()) return committed;
    return Annotate(
        committed.status(),
        absl::StrCat("map \"", common.map, "\" is left without the file (",
                     std::string(dropped.message()), "), `dsg drop ", common.map, "` removes it"));
  }
  if (!map_exists || (reason != Reason::kDeltaInvalid && reason != Reason::kTrackConflict)) {
    return committed;
  }
  return MakeError(reason,
                   absl::StrCat("map \"", common.map,
                                "\" holds another graph already, and the "
                                "file contradicts it (",
                                std::string(committed.status().message()),
                                "); `dsg-ingest` merges a newer file of the same building into "
                                "it, or import into another --map"),
                   MetadataOf(committed.status()));
}

// To the notes, so that the answer for scripts does not change.
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

absl::Status RunImport(Session* session, const ImportVerb& verb, std::ostream& out) {
  const CommonOptions& common = session->common();
  if (IsArchivePath(verb.file)) {
    // An archive keeps its own name unless --map is given.
    CommonOptions archive = common;
    if (common.map_is_default) archive.map.clear();
    return Restore(archive, {.path = verb.file, .as = archive.map}, out, session->notes());
  }
  DSG_RETURN_IF_ERROR(CheckMapName(common.map));
  Progress progress("import", &session->notes());
  DSG_ASSIGN_OR_RETURN(const FileText file, FileText::Read(verb.file));
  DSG_ASSIGN_OR_RETURN(const std::optional<MapSpec> found, FindMap(common.store, common.map));
  const std::string name = std::filesystem::path(verb.file).filename().string();
  // The digest comes first: reading frees the text.
  ContentDigest content;
  content.Add(file.text());
  const ReadOptions options = {.is_strict = verb.is_strict,
                               .passed = [&file](std::string_view text) { file.Drop(text); }};
  DSG_ASSIGN_OR_RETURN(
      ImportedGraph graph,
      ReadSceneGraph(file.text(), name, found.value_or(MapSpec()).mesh_block_size_m, options));
  TellSkipped(graph, session->notes());
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

absl::Status CheckImport(const ImportVerb& verb, const CommonOptions& common) {
  if (common.store.empty()) {
    return Usage(
        "import writes to a store folder: give --store DIR (for a server: dsg-ingest --server "
        "ADDR)",
        "import");
  }
  if (!common.map.empty() || IsArchivePath(verb.file)) return absl::OkStatus();
  return Usage("name the map to import into with --map NAME", "import");
}

}  // namespace

void AddImportVerb(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ImportVerb>({.name = "import",
                                .what = "Add a scene-graph file (Spark-DSG, Kimera) to a map",
                                .example = "--store store --map house house.json",
                                .takes = kMap | kJson,
                                .opens = Opens::kNothing,
                                .run = RunImport,
                                .check = CheckImport});
  app->add_option("FILE", verb->file, "The file; a .dsgz archive is restored")->required();
  app->add_flag("--strict", verb->is_strict,
                "Refuse a file with invalid parts, such as edges to missing nodes; without it they "
                "are skipped and counted");
}

}  // namespace dsg::cli
