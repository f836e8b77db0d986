// SPDX-License-Identifier: Apache-2.0
// What it costs to keep a map for years: committing, telling what changed, compacting, copying and
// packing it, each beside what SQLite or cp take for the same. Refuses to count what failed.
#include <filesystem>
#include <fstream>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/service/service_core.h"
#include "schema/archive/archive_map.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"
#include "tests/bench/child_process.h"
#include "tests/bench/keep_map.h"
#include "tests/bench/keep_sqlite.h"
#include "tests/bench/keep_watch.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"

namespace dsg::bench {
namespace {

namespace fs = std::filesystem;

struct Flags {
  int64_t node_count = 20'000;
  int commit_count = 300;
  int watch_count = 100;
};

constexpr int kCopyCount = 5;
constexpr double kMebibyte = 1024.0 * 1024.0;

std::string DatabasePath(const std::string& folder) {
  return absl::StrCat(folder, "/", kKeepMap, "/graph.db");
}

double MebibytesPerSecond(int64_t bytes, int64_t ns) {
  return static_cast<double>(bytes) / kMebibyte / (static_cast<double>(ns) * 1e-9);
}

absl::Status MeasureCommits(const Flags& flags, const std::string& folder,
                            const std::string& rival_folder, KeepMap* map, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kKeepMap));
  DSG_ASSIGN_OR_RETURN(const auto rows, PlainRows::Create(rival_folder, flags.node_count, 200));
  Samples ours;
  Samples ours_cpu;
  Samples rival;
  for (int i = 0; i < flags.commit_count; ++i) {
    GraphDelta delta = map->NextChange();
    absl::Status status;
    const int64_t cpu_begin_ns = ThreadCpuNs();
    ours.Add(NanosecondsOf([&] { status = writer->Commit(std::move(delta)).status(); }));
    ours_cpu.Add(ThreadCpuNs() - cpu_begin_ns);
    DSG_RETURN_IF_ERROR(status);
    rival.Add(NanosecondsOf([&] { status = rows->Change(kChangedNodeCount); }));
    DSG_RETURN_IF_ERROR(status);
  }
  report->Line("a revision of 500 changes committed, synced", "ms", Milliseconds(ours),
               Rival{"300 rows of a plain table", Milliseconds(rival)},
               {Target::Kind::kAtMost, 20.0});
  // What a busy machine does not stretch.
  report->Line("  of it processor time", "ms", Milliseconds(ours_cpu), {}, {});
  // Small ones, for the differences.
  for (int i = 0; i < flags.commit_count; ++i) {
    DSG_RETURN_IF_ERROR(writer->Commit(map->NextSmallChange()).status());
  }
  return absl::OkStatus();
}

// Differences wait for nobody, and a busy machine does not stretch this.
template <typename Work>
int64_t ProcessorNsOf(const Work& work) {
  const int64_t begin_ns = ThreadCpuNs();
  work();
  return ThreadCpuNs() - begin_ns;
}

absl::StatusOr<int64_t> Diff(query::ServiceCore* core, Revision from,
                             v1::DiffRevisionsResponse* out) {
  v1::DiffRevisionsRequest request;
  request.set_map(kKeepMap);
  request.set_from_revision(from);
  request.set_to_revision(from + 1);
  request.set_page_size(1000);
  absl::Status status;
  const int64_t ns =
      ProcessorNsOf([&] { status = core->DiffRevisions(query::CallContext(), request, out); });
  DSG_RETURN_IF_ERROR(status);
  return ns;
}

absl::Status ReadNodes(query::ServiceCore* core, const v1::DiffRevisionsResponse& diff,
                       Revision revision) {
  v1::BatchGetNodesRequest request;
  request.set_map(kKeepMap);
  request.mutable_read_at()->set_exact_revision(revision);
  for (const v1::NodeChange& change : diff.nodes()) {
    request.add_ids(change.has_after() ? change.after().id() : change.before().id());
  }
  v1::BatchGetNodesResponse reply;
  return core->BatchGetNodes(query::CallContext(), request, &reply);
}

// No call gives edges by their keys, so they are read as the engine reads them.
absl::Status ReadEdges(MapReader* map, const v1::DiffRevisionsResponse& diff, Revision revision) {
  std::vector<EdgeKey> keys;
  for (const v1::EdgeChange& change : diff.edges()) {
    const v1::Edge& edge = change.has_after() ? change.after() : change.before();
    DSG_ASSIGN_OR_RETURN(const NodeId source, ParseNodeId(edge.source()));
    DSG_ASSIGN_OR_RETURN(const NodeId target, ParseNodeId(edge.target()));
    keys.push_back({source, edge.relation(), target});
  }
  DSG_ASSIGN_OR_RETURN(const auto snapshot, map->At(revision));
  DSG_ASSIGN_OR_RETURN(const auto edges, snapshot->FindEdges(keys, {}));
  v1::ListEdgesResponse reply;
  for (const std::optional<Edge>& edge : edges) {
    if (edge.has_value()) ToProto(*edge, reply.add_edges());
  }
  return absl::OkStatus();
}

// Reading what a difference tells, at both revisions: its output.
absl::StatusOr<int64_t> ReadBothSides(query::ServiceCore* core, MapReader* map,
                                      const v1::DiffRevisionsResponse& diff, Revision from) {
  absl::Status status;
  const int64_t ns = ProcessorNsOf([&] {
    for (const Revision revision : {from, from + 1}) {
      status.Update(ReadNodes(core, diff, revision));
      status.Update(ReadEdges(map, diff, revision));
    }
  });
  DSG_RETURN_IF_ERROR(status);
  return ns;
}

absl::Status MeasureDiffs(const Flags& flags, const std::string& folder, Report* report) {
  DSG_ASSIGN_OR_RETURN(auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kKeepMap));
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  const auto core = query::MakeServiceCore(std::move(store));
  Samples small;
  Samples large;
  Samples output;
  Random random(42, 3);
  for (int i = 0; i < flags.commit_count; ++i) {
    const Revision last_large = head.revision - flags.commit_count;
    v1::DiffRevisionsResponse reply;
    DSG_ASSIGN_OR_RETURN(const int64_t small_ns,
                         Diff(core.get(), last_large + random.Index(flags.commit_count), &reply));
    if (i > 0) small.Add(small_ns);
    const Revision from = last_large - 1 - random.Index(flags.commit_count - 1);
    v1::DiffRevisionsResponse many;
    DSG_ASSIGN_OR_RETURN(const int64_t large_ns, Diff(core.get(), from, &many));
    DSG_ASSIGN_OR_RETURN(const int64_t output_ns, ReadBothSides(core.get(), map.get(), many, from));
    if (i == 0) continue;
    large.Add(large_ns);
    output.Add(output_ns);
  }
  report->Line("difference of adjacent revisions, 1 change, processor time", "ms",
               Milliseconds(small), {}, {Target::Kind::kAtMost, 1.0});
  const Figure of_large = Milliseconds(large);
  const Figure of_output = Milliseconds(output);
  report->Line("difference of adjacent revisions, 500 changes, processor time", "ms", of_large,
               Rival{"reading its 300 nodes and 200 edges at both", of_output}, {});
  report->Line("  more than that", "ms", {of_large.value - of_output.value, {}}, {},
               {Target::Kind::kAtMost, 1.0});
  return absl::OkStatus();
}

// Nanoseconds until the copy is on the disk; it is removed again.
template <typename Copy>
absl::StatusOr<int64_t> TimeCopy(const std::string& target, const Copy& copy) {
  absl::Status status;
  const int64_t ns = NanosecondsOf([&] { status = copy(target); });
  std::error_code ignored;
  fs::remove(target, ignored);
  fs::remove(target + "-journal", ignored);
  DSG_RETURN_IF_ERROR(status);
  return ns;
}

absl::Status MeasureCopies(const std::string& folder, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kKeepMap));
  const std::string database = DatabasePath(folder);
  const auto bytes = static_cast<int64_t>(fs::file_size(database));
  const std::string target = folder + "/copy";
  Samples ours;
  Samples cp;
  Samples backup;
  Samples vacuum;
  for (int i = 0; i < kCopyCount; ++i) {
    DSG_ASSIGN_OR_RETURN(const int64_t ours_ns, TimeCopy(target, [&](const std::string& to) {
                           return map->CopyTo(to, {}, {});
                         }));
    ours.Add(ours_ns);
    // Synced as ours is, or it would be a measurement of memory.
    DSG_ASSIGN_OR_RETURN(
        const int64_t cp_ns, TimeCopy(target, [&](const std::string& to) {
          return RunAndMeasure({"/bin/sh", "-c",
                                absl::StrCat("cp '", database, "' '", to, "' && sync '", to, "'")})
              .status();
        }));
    cp.Add(cp_ns);
    DSG_ASSIGN_OR_RETURN(const int64_t backup_ns, TimeCopy(target, [&](const std::string& to) {
                           return CopyBySqliteBackup(database, to);
                         }));
    backup.Add(backup_ns);
    DSG_ASSIGN_OR_RETURN(const int64_t vacuum_ns, TimeCopy(target, [&](const std::string& to) {
                           return CopyByVacuumInto(database, to);
                         }));
    vacuum.Add(vacuum_ns);
  }
  report->Note(absl::StrCat("the file has ", bytes / 1'000'000, " MB"));
  const auto rate = [&](const Samples& samples) {
    return Figure{MebibytesPerSecond(bytes, static_cast<int64_t>(samples.Percentile(0.5))), {}};
  };
  report->Line("copying a map", "MiB/s", rate(ours), Rival{"cp and sync", rate(cp)}, {});
  report->Line("copying a map", "MiB/s", rate(ours), Rival{"SQLite .backup", rate(backup)}, {});
  report->Line("copying a map", "MiB/s", rate(ours), Rival{"VACUUM INTO", rate(vacuum)}, {});
  return absl::OkStatus();
}

absl::Status MeasureArchive(const std::string& folder, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kKeepMap));
  const auto bytes = static_cast<int64_t>(fs::file_size(DatabasePath(folder)));
  int64_t packed_bytes = 0;
  absl::Status status;
  const int64_t ns = NanosecondsOf([&]() {
    auto archive = ArchiveMap(map.get(), folder, {}, {});
    status = archive.status();
    while (status.ok() && !(*archive)->done()) {
      const auto piece = (*archive)->Next({});
      status = piece.status();
      if (status.ok()) packed_bytes += static_cast<int64_t>(piece->size());
    }
  });
  DSG_RETURN_IF_ERROR(status);
  report->Line("archive of a map", "MB", {static_cast<double>(packed_bytes) * 1e-6, {}},
               Rival{"its file", {static_cast<double>(bytes) * 1e-6, {}}}, {});
  report->Line("archiving, of the file", "MiB/s", {MebibytesPerSecond(bytes, ns), {}}, {}, {});
  return absl::OkStatus();
}

absl::Status MeasureCompaction(const std::string& folder, Report* report) {
  const std::string copy = folder + "/before";
  const std::string database = DatabasePath(folder);
  fs::copy_file(database, copy);
  DSG_ASSIGN_OR_RETURN(const int64_t vacuum_ns,
                       TimeCopy(folder + "/copy",
                                [&](const std::string& to) { return CopyByVacuumInto(copy, to); }));
  const auto bytes = static_cast<int64_t>(fs::file_size(copy));
  fs::remove(copy);
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kKeepMap));
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kKeepMap));
  absl::StatusOr<CompactReport> compacted = absl::UnknownError("not run");
  const int64_t ns = NanosecondsOf([&] { compacted = writer->Compact(head.revision, {}, {}); });
  DSG_RETURN_IF_ERROR(compacted.status());
  report->Note(absl::StrCat("compacted: ", compacted->row_count, " rows of ",
                            compacted->revision_count, " revisions, ", bytes / 1'000'000, " to ",
                            fs::file_size(database) / 1'000'000, " MB, in ", ns / 1'000'000,
                            " ms"));
  report->Line("compaction, rows that go", "rows/s",
               {static_cast<double>(compacted->row_count) / (static_cast<double>(ns) * 1e-9), {}},
               {}, {});
  report->Line("compaction, of the file before", "MiB/s", {MebibytesPerSecond(bytes, ns), {}},
               Rival{"VACUUM INTO of it", {MebibytesPerSecond(bytes, vacuum_ns), {}}}, {});
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "keep"));
  DSG_ASSIGN_OR_RETURN(const auto rival, ScratchFolder::Make(common.folder, "keep-rival"));
  // The path of a socket has at most 107 characters; the temporary folder's is short.
  DSG_ASSIGN_OR_RETURN(const auto socket_folder,
                       ScratchFolder::Make(fs::temp_directory_path(), "dsg-keep"));
  KeepMap map(flags.node_count);
  DSG_RETURN_IF_ERROR(map.Make(folder->path()));
  ShowProgress("map is made");
  DSG_RETURN_IF_ERROR(MeasureCommits(flags, folder->path(), rival->path(), &map, report));
  ShowProgress("commits done");
  DSG_RETURN_IF_ERROR(MeasureDiffs(flags, folder->path(), report));
  ShowProgress("differences done");
  if (flags.watch_count > 0) {
    DSG_RETURN_IF_ERROR(MeasureWatch(&map, folder->path(),
                                     absl::StrCat("unix:", socket_folder->path(), "/s"),
                                     flags.watch_count, report));
    ShowProgress("watch done");
  }
  DSG_RETURN_IF_ERROR(MeasureCopies(folder->path(), report));
  DSG_RETURN_IF_ERROR(MeasureArchive(folder->path(), report));
  ShowProgress("copies done");
  return MeasureCompaction(folder->path(), report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  dsg::bench::Flags flags;
  CLI::App app("What keeping a map for years costs.", "keep_bench");
  app.add_option("--nodes", flags.node_count, "Nodes of the map")->capture_default_str();
  app.add_option("--commits", flags.commit_count, "Revisions of 500 changes")
      ->capture_default_str();
  app.add_option("--watched", flags.watch_count, "Revisions that are waited for, 0 = none")
      ->capture_default_str();
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
