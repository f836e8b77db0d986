// SPDX-License-Identifier: Apache-2.0
// W2 in our store: bytes, load, one changed node, cold statistics, nearest place, agent at a time.
// Each beside a rival of the same run; only the peer's file size is a constant, and named so.
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/child_process.h"
#include "tests/bench/report.h"
#include "tests/bench/row_table.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

constexpr char kMap[] = "w2";
constexpr char kSession[] = "w2_bench";
constexpr size_t kCommitSize = 100'000;
constexpr int kChangeCount = 100;
constexpr int kQuestionCount = 2'000;
constexpr int kColdRunCount = 15;
constexpr double kMebibyte = 1024.0 * 1024.0;

absl::Status LoadGraph(GraphDelta graph, const std::string& folder, Report* report) {
  StoreOptions options;
  options.create = true;
  options.reserve_bytes = 0;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(auto writer, store->OpenWriter(kMap));
  graph.map = kMap;
  graph.session_id = kSession;
  graph.sequence = 1;
  absl::Status status;
  const int64_t ns = NanosecondsOf([&] {
    for (GraphDelta& part : SplitDelta(std::move(graph), kCommitSize)) {
      status = writer->Commit(std::move(part)).status();
      if (!status.ok()) return;
    }
    writer.reset();
  });
  DSG_RETURN_IF_ERROR(status);
  report->Note(absl::StrCat("loaded in ", ns / 1'000'000, " ms, durably"));
  return absl::OkStatus();
}

absl::Status CheckCounts(const Snapshot& snapshot) {
  DSG_ASSIGN_OR_RETURN(const MapStats stats, snapshot.Stats());
  // One node more than the peer's graph: the robot that has the poses as its track.
  if (stats.at.node_count == kW2NodeCount + 1 && stats.at.edge_count == kW2EdgeCount &&
      stats.at.pose_count == kW2PoseCount) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("the store holds ", stats.at.node_count, " nodes, ",
                                          stats.at.edge_count, " edges, ", stats.at.pose_count,
                                          " poses"));
}

// A table of poses as small as W2's, for its cheapest possible synced change.
absl::StatusOr<std::unique_ptr<RowTable>> MakePlainTable(const GraphDelta& graph,
                                                         const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(auto table, RowTable::Create(folder, 1));
  DSG_RETURN_IF_ERROR(table->Insert(graph.appends));
  return table;
}

absl::Status MeasureOneNodeCommits(const GraphDelta& graph, const std::string& folder,
                                   const std::string& rows_folder, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {.reserve_bytes = 0}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
  DSG_ASSIGN_OR_RETURN(const SessionState session, writer->GetSession(kSession));
  DSG_ASSIGN_OR_RETURN(const auto table, MakePlainTable(graph, rows_folder));
  Random random(42, 1);
  Samples ours;
  Samples rows;
  for (int i = 1; i <= kChangeCount; ++i) {
    GraphDelta delta;
    delta.map = kMap;
    delta.session_id = kSession;
    delta.sequence = session.last_sequence + i;
    const NodeId id('O', static_cast<uint64_t>(random.Index(kW2ObjectCount)));
    DSG_ASSIGN_OR_RETURN(const auto before, map->Latest());
    DSG_ASSIGN_OR_RETURN(Node node, before->GetNode(id));
    node.observation_count += i;
    delta.nodes.push_back(node);
    absl::Status committed;
    ours.Add(NanosecondsOf([&] { committed = writer->Commit(std::move(delta)).status(); }));
    DSG_RETURN_IF_ERROR(committed);
    DSG_ASSIGN_OR_RETURN(const auto after, map->Latest());
    DSG_ASSIGN_OR_RETURN(const Node read, after->GetNode(id));
    if (read.observation_count != node.observation_count) {
      return absl::DataLossError(absl::StrCat("the change of ", ToString(id), " is not there"));
    }
    absl::Status touched;
    rows.Add(NanosecondsOf(
        [&] { touched = table->Touch(W2Robot(), random.Index(kW2PoseCount) * kW2PosePeriodNs); }));
    DSG_RETURN_IF_ERROR(touched);
  }
  report->Line("one changed node committed", "ms", Milliseconds(ours),
               Rival{"one row of a plain table", Milliseconds(rows)},
               {Target::Kind::kAtMost, 10.0});
  return absl::OkStatus();
}

// Runs as its own process: what it costs to have all of the graph in memory.
int LoadAll(const std::string& folder) {
  const auto store = GraphStore::Open(folder, {});
  if (!store.ok()) return 2;
  const auto map = (*store)->OpenMap(kMap);
  if (!map.ok()) return 2;
  const auto snapshot = (*map)->Latest();
  if (!snapshot.ok()) return 2;
  std::vector<Node> nodes;
  std::vector<Edge> edges;
  const bool read = (*snapshot)
                        ->ScanNodes({}, NodeId(), {},
                                    [&](const Node& node) {
                                      nodes.push_back(node);
                                      return true;
                                    })
                        .ok() &&
                    (*snapshot)
                        ->ScanEdges({}, {}, {},
                                    [&](const Edge& edge) {
                                      edges.push_back(edge);
                                      return true;
                                    })
                        .ok();
  return read && nodes.size() == kW2NodeCount + 1 && edges.size() == kW2EdgeCount ? 0 : 2;
}

struct ColdRuns {
  Samples wall;
  double resident_mib_max = 0.0;
};

absl::StatusOr<ColdRuns> RunCold(const std::vector<std::string>& command, int count,
                                 const std::string& folder) {
  ColdRuns runs;
  for (int i = 0; i < count; ++i) {
    EvictFromPageCache(folder);
    DSG_ASSIGN_OR_RETURN(const Usage usage, RunAndMeasure(command));
    runs.wall.Add(usage.wall_ns);
    runs.resident_mib_max =
        std::max(runs.resident_mib_max, static_cast<double>(usage.resident_bytes_max) / kMebibyte);
  }
  return runs;
}

absl::Status MeasureColdStats(const std::string& folder, Report* report) {
  const std::vector<std::string> stats = {
      absl::StrCat(DSG_BINARY_DIR, "/dsg"), "stats", "--store", folder, "--map", kMap, "--json"};
  DSG_ASSIGN_OR_RETURN(const ColdRuns ours, RunCold(stats, kColdRunCount, folder));
  ShowProgress("cold statistics done; reading everything in a fresh process");
  DSG_ASSIGN_OR_RETURN(const ColdRuns all,
                       RunCold({"/proc/self/exe", "--load-all", folder}, 3, folder));
  DSG_ASSIGN_OR_RETURN(
      const ColdRuns bare,
      RunCold({absl::StrCat(DSG_BINARY_DIR, "/dsg"), "--help"}, kColdRunCount, folder));
  report->Line("cold dsg stats, a fresh process", "ms", Milliseconds(ours.wall),
               Rival{"loading all of it", Milliseconds(all.wall)}, {});
  report->Line("resident memory of it", "MiB", {ours.resident_mib_max, {}},
               Rival{"loading all of it", {all.resident_mib_max, {}}},
               {Target::Kind::kRatioAtMost, 0.25});
  report->Line("  a bare dsg --help", "MiB", {bare.resident_mib_max, {}}, {}, {});
  return absl::OkStatus();
}

// The scan that the peer's users write: the pose nearest in time, then up to its place.
int ScanForPose(const std::vector<TimedPose>& poses, TimeNs at_ns) {
  int best = 0;
  TimeNs best_ns = kTimeMax;
  for (size_t i = 0; i < poses.size(); ++i) {
    const TimeNs off_ns = std::abs(poses[i].time_ns - at_ns);
    if (off_ns >= best_ns) continue;
    best_ns = off_ns;
    best = static_cast<int>(i);
  }
  return best;
}

absl::Status MeasureAgentAtTime(const GraphDelta& graph, const Snapshot& snapshot, Report* report) {
  const std::vector<TimedPose>& poses = graph.appends.front().poses;
  Random random(42, 3);
  Samples ours;
  Samples scan;
  for (int i = 0; i < kQuestionCount; ++i) {
    const auto at_ns = static_cast<TimeNs>(
        random.Uniform(0, static_cast<double>((kW2PoseCount - 1) * kW2PosePeriodNs)));
    absl::StatusOr<LocatedPose> located = absl::InternalError("not asked");
    absl::StatusOr<std::optional<Stay>> stay = absl::InternalError("not asked");
    ours.Add(NanosecondsOf([&] {
      located = snapshot.Locate(W2Robot(), at_ns);
      stay = snapshot.StayAt(W2Robot(), at_ns);
    }));
    int nearest = 0;
    scan.Add(NanosecondsOf([&] { nearest = ScanForPose(poses, at_ns); }));
    DSG_RETURN_IF_ERROR(located.status());
    DSG_RETURN_IF_ERROR(stay.status());
    const Eigen::Vector3d off =
        located->map_T_agent.position - poses[static_cast<size_t>(nearest)].map_T_agent.position;
    // Half a period away from the nearest pose at most: 3.3 mm at 64 mm/s.
    if (!stay->has_value() || off.norm() > 0.0034) {
      return absl::DataLossError(
          absl::StrCat("the robot at ", at_ns, " ns is ", off.norm(), " m from its nearest pose"));
    }
  }
  report->Line("agent at a time, with place and room", "us", Microseconds(ours),
               Rival{"scan of 10,000", Microseconds(scan)}, {});
  return absl::OkStatus();
}

absl::Status Run(const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "w2"));
  DSG_ASSIGN_OR_RETURN(const auto rows_folder, ScratchFolder::Make(common.folder, "w2-rows"));
  const GraphDelta graph = W2Graph();
  report->Note(absl::StrCat(graph.nodes.size(), " nodes (W2's ", kW2NodeCount, " and a robot), ",
                            graph.edges.size(), " edges, ", graph.appends.front().poses.size(),
                            " poses, ", graph.stays.size(), " stays"));
  DSG_RETURN_IF_ERROR(LoadGraph(graph, folder->path(), report));
  ShowProgress("loaded");
  DSG_RETURN_IF_ERROR(MeasureOneNodeCommits(graph, folder->path(), rows_folder->path(), report));
  report->Line(
      "on disk, with the history of these commits", "MB",
      {static_cast<double>(BytesIn(folder->path())) * 1e-6, {}},
      Rival{"Spark-DSG 1.1.3 binary (published)", {static_cast<double>(kW2PeerBytes) * 1e-6, {}}},
      {Target::Kind::kAtMost, 60.6});
  DSG_RETURN_IF_ERROR(MeasureColdStats(folder->path(), report));
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder->path(), {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
  DSG_ASSIGN_OR_RETURN(const auto snapshot, map->Latest());
  DSG_RETURN_IF_ERROR(CheckCounts(*snapshot));
  return MeasureAgentAtTime(graph, *snapshot, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  std::string load_all;
  CLI::App app("W2: 120,101 nodes and 418,099 edges.", "w2_bench");
  // For the run that starts itself again to read everything; of no use to people.
  app.add_option("--load-all", load_all)->group("");
  return dsg::bench::RunBenchmark(
      &app, argc, argv,
      [&load_all](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        if (load_all.empty()) return dsg::bench::Run(common, report);
        return dsg::bench::LoadAll(load_all) == 0 ? absl::OkStatus()
                                                  : absl::DataLossError("not all could be read");
      });
}
