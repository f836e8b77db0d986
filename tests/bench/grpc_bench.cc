// SPDX-License-Identifier: Apache-2.0
// Load on a running dsg-server over a unix socket, through the generated stubs: one LocateAgent
// beside an empty call on the same server, and lookups per second in batches beside single calls.
// Refuses to count a lookup that failed.
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <thread>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/child_process.h"
#include "tests/bench/crowd.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/wire_client.h"

namespace dsg::bench {
namespace {

constexpr char kMap[] = "crowd";
constexpr uint64_t kSeed = 20240608;
constexpr double kRoomSideM = 10.0;
constexpr int kRoomsX = 8;
constexpr int kRoomsY = 6;

struct Flags {
  int agent_count = 100;
  int poses_per_agent = 10'000;
  int unary_count = 20'000;
  int batch_size = 1000;
  int thread_count = 2;
  double seconds = 5.0;
};

NodeId RoomAt(const Eigen::Vector3d& p) {
  const auto cell = [](double metres, int count) {
    return std::clamp(static_cast<int>(metres / kRoomSideM), 0, count - 1);
  };
  const int floor = std::clamp(static_cast<int>(p.z() / kFloorHeightM), 0, kFloorCount - 1);
  const int index = (floor * kRoomsY + cell(p.y(), kRoomsY)) * kRoomsX + cell(p.x(), kRoomsX);
  return NodeId('R', static_cast<uint64_t>(index));
}

void AddRooms(GraphDelta* delta) {
  const NodeId building('B', 0);
  Node root;
  root.id = building;
  root.layer = layers::kBuildings;
  root.kind = kinds::kBuilding;
  delta->nodes.push_back(root);
  for (int i = 0; i < kFloorCount * kRoomsY * kRoomsX; ++i) {
    Node room;
    room.id = NodeId('R', static_cast<uint64_t>(i));
    room.layer = layers::kRooms;
    room.kind = kinds::kRoom;
    const Eigen::Vector3d half(0.5 * kRoomSideM, 0.5 * kRoomSideM, 0.5 * kFloorHeightM);
    room.box_node = Box3d(-half, half);
    const Eigen::Vector3i cell(i % kRoomsX, i / kRoomsX % kRoomsY, i / (kRoomsX * kRoomsY));
    room.map_T_node.position = cell.cast<double>().cwiseProduct(2.0 * half) + half;
    delta->nodes.push_back(room);
    Edge edge;
    edge.source = building;
    edge.relation = relations::kContains;
    edge.target = room.id;
    delta->edges.push_back(edge);
  }
  FitBoxesToChildren(delta);
}

void AddStays(const TrajectoryAppend& append, std::vector<Stay>* stays) {
  const size_t first = stays->size();
  for (const TimedPose& pose : append.poses) {
    const NodeId room = RoomAt(pose.map_T_agent.position);
    if (stays->size() > first && stays->back().room == room) continue;
    if (stays->size() > first) stays->back().exit_ns = pose.time_ns;
    stays->push_back({append.agent, NodeId(), room, pose.time_ns, kTimeMax});
  }
}

absl::Status MakeStore(const Flags& flags, const std::string& folder) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  spec.epoch_ns = kCrowdEpochNs;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kMap));
  Crowd crowd(kSeed, flags.agent_count);
  GraphDelta delta;
  delta.map = kMap;
  delta.session_id = "grpc_bench";
  delta.sequence = 1;
  AddRooms(&delta);
  for (Node& node : crowd.Nodes()) delta.nodes.push_back(std::move(node));
  delta.appends = crowd.Next(flags.poses_per_agent);
  for (const TrajectoryAppend& append : delta.appends) AddStays(append, &delta.stays);
  return writer->Commit(std::move(delta)).status();
}

void FillInstant(const Flags& flags, Random* random, std::string* agent, int64_t* at_ns) {
  *agent = ToString(CrowdAgent(random->Index(flags.agent_count)));
  *at_ns = kCrowdEpochNs + static_cast<TimeNs>(random->Uniform(1.0, flags.poses_per_agent - 2.0) *
                                               static_cast<double>(kPosePeriodNs));
}

v1::LocateAgentRequest RandomLookup(const Flags& flags, Random* random) {
  v1::LocateAgentRequest request;
  request.set_map(kMap);
  int64_t at_ns = 0;
  FillInstant(flags, random, request.mutable_agent(), &at_ns);
  request.set_at_ns(at_ns);
  return request;
}

absl::Status CheckReply(const Snapshot& snapshot, const v1::LocateAgentRequest& request,
                        const v1::LocateAgentResponse& reply) {
  DSG_ASSIGN_OR_RETURN(const NodeId agent, ParseNodeId(request.agent()));
  DSG_ASSIGN_OR_RETURN(const LocatedPose expected, snapshot.Locate(agent, request.at_ns()));
  const Eigen::Vector3d& p = expected.map_T_agent.position;
  const v1::Vector3& q = reply.pose().position();
  if (q.x() == p.x() && q.y() == p.y() && q.z() == p.z() && !reply.room_id().empty() &&
      reply.building_id() == "B0") {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("the answer about ", request.agent(), " at ",
                                          request.at_ns(),
                                          " is not the store's: ", reply.ShortDebugString()));
}

// Both calls in turn, on one connection of one thread.
absl::Status MeasureUnary(const Flags& flags, const WireClient& client, const Snapshot& snapshot,
                          Report* report) {
  constexpr int kWarmupCount = 2000;
  Random random(kSeed, 1'000'000);
  Samples ours;
  Samples empty;
  for (int i = 0; i < kWarmupCount + flags.unary_count; ++i) {
    const v1::LocateAgentRequest request = RandomLookup(flags, &random);
    v1::LocateAgentResponse reply;
    v1::GetServerInfoResponse info;
    grpc::Status located;
    grpc::Status informed;
    const auto locate = [&] {
      located = Call(client.query.get(), &v1::QueryService::Stub::LocateAgent, request, &reply);
    };
    const auto inform = [&] {
      informed = Call(client.map.get(), &v1::MapService::Stub::GetServerInfo,
                      v1::GetServerInfoRequest(), &info);
    };
    // Who comes second finds a warmer connection; take turns.
    int64_t inform_ns = i % 2 == 0 ? NanosecondsOf(inform) : 0;
    const int64_t locate_ns = NanosecondsOf(locate);
    if (i % 2 != 0) inform_ns = NanosecondsOf(inform);
    DSG_RETURN_IF_ERROR(FromGrpc(located));
    DSG_RETURN_IF_ERROR(FromGrpc(informed));
    DSG_RETURN_IF_ERROR(CheckReply(snapshot, request, reply));
    if (i < kWarmupCount) continue;
    ours.Add(locate_ns);
    empty.Add(inform_ns);
  }
  report->Line("unary LocateAgent", "us", Microseconds(ours),
               Rival{"empty call", Microseconds(empty)}, {Target::Kind::kRatioAtMost, 1.3});
  return absl::OkStatus();
}

// What one load thread has done.
struct Tally {
  int64_t lookup_count = 0;
  Samples calls;
  absl::Status status;
};

v1::BatchLocateAgentsRequest RandomBatch(const Flags& flags, Random* random) {
  v1::BatchLocateAgentsRequest request;
  request.set_map(kMap);
  for (int i = 0; i < flags.batch_size; ++i) {
    v1::AgentInstant* instant = request.add_instants();
    int64_t at_ns = 0;
    FillInstant(flags, random, instant->mutable_agent(), &at_ns);
    instant->set_at_ns(at_ns);
  }
  return request;
}

absl::Status CheckBatch(const v1::BatchLocateAgentsRequest& request,
                        const v1::BatchLocateAgentsResponse& reply) {
  if (reply.results_size() != request.instants_size()) {
    return absl::DataLossError("a batch came back with another number of results");
  }
  for (int i = 0; i < reply.results_size(); ++i) {
    const v1::LocateResult& result = reply.results(i);
    if (result.status_code() == 0 && result.agent_id() == request.instants(i).agent() &&
        result.quality() == v1::INTERPOLATED && !result.room_id().empty()) {
      continue;
    }
    return absl::DataLossError(
        absl::StrCat("a lookup of a batch failed: ", result.ShortDebugString()));
  }
  return absl::OkStatus();
}

void LoadInBatches(const Flags& flags, const WireClient& client, uint64_t stream,
                   const std::atomic<bool>& stop, Tally* tally) {
  constexpr int kRequestCount = 16;
  Random random(kSeed, stream);
  std::vector<v1::BatchLocateAgentsRequest> requests;
  for (int i = 0; i < kRequestCount; ++i) requests.push_back(RandomBatch(flags, &random));
  v1::BatchLocateAgentsResponse reply;
  for (size_t i = 0; !stop && tally->status.ok(); ++i) {
    const v1::BatchLocateAgentsRequest& request = requests[i % requests.size()];
    grpc::Status called;
    tally->calls.Add(NanosecondsOf([&] {
      called =
          Call(client.query.get(), &v1::QueryService::Stub::BatchLocateAgents, request, &reply);
    }));
    tally->status = called.ok() ? CheckBatch(request, reply) : FromGrpc(called);
    tally->lookup_count += flags.batch_size;
  }
}

void LoadOneByOne(const Flags& flags, const WireClient& client, uint64_t stream,
                  const std::atomic<bool>& stop, Tally* tally) {
  Random random(kSeed, stream);
  v1::LocateAgentResponse reply;
  while (!stop && tally->status.ok()) {
    const v1::LocateAgentRequest request = RandomLookup(flags, &random);
    grpc::Status called;
    tally->calls.Add(NanosecondsOf([&] {
      called = Call(client.query.get(), &v1::QueryService::Stub::LocateAgent, request, &reply);
    }));
    tally->status = FromGrpc(called);
    ++tally->lookup_count;
  }
}

using Loader = void (*)(const Flags&, const WireClient&, uint64_t, const std::atomic<bool>&,
                        Tally*);

struct Throughput {
  double lookups_per_s = 0.0;
  /// Of the first thread's calls.
  Samples calls;
};

absl::StatusOr<Throughput> RunLoad(const Flags& flags, const std::string& address, Loader loader) {
  std::vector<WireClient> clients;
  for (int i = 0; i < flags.thread_count; ++i) {
    DSG_ASSIGN_OR_RETURN(WireClient client, Connect(address));
    clients.push_back(std::move(client));
  }
  std::vector<Tally> tallies(clients.size());
  std::atomic<bool> stop{false};
  const int64_t ns = NanosecondsOf([&] {
    std::vector<std::thread> threads;
    for (size_t i = 0; i < clients.size(); ++i) {
      threads.emplace_back(loader, std::cref(flags), std::cref(clients[i]), 2'000'000 + i,
                           std::cref(stop), &tallies[i]);
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(flags.seconds));
    stop = true;
    for (std::thread& thread : threads) thread.join();
  });
  Throughput throughput;
  int64_t count = 0;
  for (const Tally& tally : tallies) {
    DSG_RETURN_IF_ERROR(tally.status);
    count += tally.lookup_count;
  }
  throughput.lookups_per_s = static_cast<double>(count) * 1e9 / static_cast<double>(ns);
  throughput.calls = std::move(tallies.front().calls);
  return throughput;
}

absl::Status MeasureBatches(const Flags& flags, const std::string& address, Report* report) {
  DSG_ASSIGN_OR_RETURN(const Throughput singles, RunLoad(flags, address, LoadOneByOne));
  DSG_ASSIGN_OR_RETURN(const Throughput batches, RunLoad(flags, address, LoadInBatches));
  report->Line(absl::StrCat("BatchLocateAgents, ", flags.thread_count, " client threads"),
               "lookups/s", {batches.lookups_per_s, {}},
               Rival{"one call a lookup", {singles.lookups_per_s, {}}},
               {Target::Kind::kAtLeast, 300'000.0});
  report->Line(absl::StrCat("a call of ", flags.batch_size), "ms", Milliseconds(batches.calls),
               Rival{"of one", Milliseconds(singles.calls)}, {});
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "grpc"));
  // The path of a socket has at most 107 characters; the temporary folder's is short.
  DSG_ASSIGN_OR_RETURN(const auto socket_folder,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-bench"));
  DSG_RETURN_IF_ERROR(MakeStore(flags, folder->path()));
  const std::string address = absl::StrCat("unix:", socket_folder->path(), "/server.sock");
  DSG_ASSIGN_OR_RETURN(
      const auto server,
      ChildServer::Start({absl::StrCat(DSG_BINARY_DIR, "/dsg-server"), "--store", folder->path(),
                          "--listen", address, "--log-level", "warning"}));
  ShowProgress("server is up");
  report->Note(absl::StrCat(flags.agent_count, " agents x ", flags.poses_per_agent,
                            " poses with stays in rooms; server and clients share the cores"));
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder->path(), {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(kMap));
  DSG_ASSIGN_OR_RETURN(const auto snapshot, map->Latest());
  DSG_ASSIGN_OR_RETURN(const WireClient client, Connect(address));
  DSG_RETURN_IF_ERROR(MeasureUnary(flags, client, *snapshot, report));
  ShowProgress("unary calls done");
  return MeasureBatches(flags, address, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  dsg::bench::Flags flags;
  CLI::App app("Calls over a unix socket on a running dsg-server.", "grpc_bench");
  app.add_option("--agents", flags.agent_count, "Agents")->capture_default_str();
  app.add_option("--poses", flags.poses_per_agent, "Poses of each agent")->capture_default_str();
  app.add_option("--calls", flags.unary_count, "Unary calls of each kind")->capture_default_str();
  app.add_option("--batch", flags.batch_size, "Lookups a batch")->capture_default_str();
  app.add_option("--threads", flags.thread_count, "Client threads")->capture_default_str();
  app.add_option("--seconds", flags.seconds, "How long each load lasts")->capture_default_str();
  return dsg::bench::RunBenchmark(
      &app, argc, argv,
      [&flags](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
