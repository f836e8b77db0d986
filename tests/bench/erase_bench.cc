// SPDX-License-Identifier: Apache-2.0
// What robots feel of a long erasure: how long their commits take while a server erases most of one
// map, those of robots on that map and those of robots on others. Refuses to count what failed.
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <thread>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.grpc.pb.h"
#include "dsg/v1/maintenance_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/wire_server.h"

namespace dsg::bench {
namespace {

struct Flags {
  int node_count = 60'000;
  int version_count = 4;
  int robot_count = 8;
  int calm_s = 5;
};

constexpr char kErased[] = "erased";
constexpr std::chrono::milliseconds kPause{50};

std::string OtherMap(int robot) { return absl::StrCat("other", robot); }

Node Thing(int index, int version) {
  Node node;
  node.id = NodeId('O', static_cast<uint64_t>(index));
  node.layer = layers::kObjects;
  node.kind = kinds::kObject;
  node.name = absl::StrCat("thing ", index);
  node.observation_count = version;
  node.attributes["note"] = std::string(200, static_cast<char>('a' + version % 26));
  return node;
}

absl::Status MakeMaps(const Flags& flags, const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {.create = true}));
  for (int robot = 0; robot < flags.robot_count; ++robot) {
    DSG_RETURN_IF_ERROR(store->CreateMap({.name = OtherMap(robot)}));
  }
  DSG_RETURN_IF_ERROR(store->CreateMap({.name = kErased}));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kErased));
  constexpr int kNodesPerDelta = 2'000;
  int64_t sequence = 0;
  for (int version = 1; version <= flags.version_count; ++version) {
    for (int next = 0; next < flags.node_count;) {
      GraphDelta delta;
      delta.map = kErased;
      delta.session_id = "world";
      delta.sequence = ++sequence;
      for (int i = 0; i < kNodesPerDelta && next < flags.node_count; ++i, ++next) {
        delta.nodes.push_back(Thing(next, version));
      }
      DSG_RETURN_IF_ERROR(writer->Commit(std::move(delta)).status());
    }
    ShowProgress(absl::StrCat("version ", version, " of ", flags.version_count, " written"));
  }
  return absl::OkStatus();
}

// Commits one room again and again, as long as it may.
class Robot {
 public:
  Robot(const std::string& address, std::string map, int number)
      : stub_(v1::IngestService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))),
        map_(std::move(map)),
        number_(number) {}

  void Run(const std::atomic<bool>& is_over, const std::atomic<bool>& is_erasing) {
    for (int64_t sequence = 1; !is_over; ++sequence) {
      v1::CommitRequest request;
      v1::GraphDelta* const delta = request.mutable_delta();
      delta->set_map(map_);
      delta->set_session_id(absl::StrCat("robot", number_));
      delta->set_sequence(sequence);
      v1::Node* const node = delta->add_nodes();
      node->set_id(absl::StrCat("R", number_));
      node->set_layer("rooms");
      node->set_kind("room");
      node->set_observation_count(sequence);
      const bool was_erasing = is_erasing;
      grpc::ClientContext context;
      v1::CommitResponse response;
      grpc::Status status;
      const int64_t ns =
          NanosecondsOf([&] { status = stub_->Commit(&context, request, &response); });
      if (!status.ok()) {
        failure_ = absl::InternalError(absl::StrCat(map_, ": ", status.error_message()));
        return;
      }
      (was_erasing ? beside : calm).Add(ns);
      std::this_thread::sleep_for(kPause);
    }
  }

  const absl::Status& failure() const { return failure_; }

  Samples calm;
  Samples beside;

 private:
  std::unique_ptr<v1::IngestService::Stub> stub_;
  const std::string map_;
  const int number_;
  absl::Status failure_;
};

absl::Status Erase(const std::string& address) {
  const auto stub = v1::MaintenanceService::NewStub(
      grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  v1::PruneRequest request;
  request.set_map(kErased);
  request.set_allow_everything(true);
  v1::PrunePolicy* const policy = request.add_policies();
  policy->set_layer("objects");
  policy->set_strength(v1::ERASE);
  grpc::ClientContext context;
  const auto stream = stub->Prune(&context, request);
  v1::PruneResponse response;
  while (stream->Read(&response)) {
    ShowProgress(absl::StrCat("erasing: ", static_cast<int>(100.0 * response.progress()), " %"));
  }
  const grpc::Status status = stream->Finish();
  if (!status.ok()) return absl::InternalError(status.error_message());
  return response.erased() ? absl::OkStatus() : absl::InternalError("not all was erased");
}

void AddLines(const std::string& who, const Samples& calm, const Samples& beside, double worst_max,
              Report* report) {
  report->Line(absl::StrCat("commit of robots on ", who, ", while a map is erased"), "ms",
               Milliseconds(beside), Rival{"in calm", Milliseconds(calm)}, {});
  const Target target = worst_max > 0.0 ? Target{Target::Kind::kAtMost, worst_max} : Target{};
  report->Line("  the longest", "ms", {beside.Percentile(1.0) * 1e-6, {}},
               Rival{"in calm", {calm.Percentile(1.0) * 1e-6, {}}}, target);
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "erase"));
  // The path of a socket must be short.
  DSG_ASSIGN_OR_RETURN(const auto sockets,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-erase"));
  DSG_RETURN_IF_ERROR(MakeMaps(flags, folder->path()));
  DSG_ASSIGN_OR_RETURN(
      const WireServer server,
      StartWireServer({.store = folder->path(), .listen = "unix:" + sockets->path() + "/socket"}));
  std::vector<std::unique_ptr<Robot>> here;
  std::vector<std::unique_ptr<Robot>> elsewhere;
  for (int i = 0; i < flags.robot_count; ++i) {
    here.push_back(std::make_unique<Robot>(server.address, kErased, i));
    elsewhere.push_back(std::make_unique<Robot>(server.address, OtherMap(i), i));
  }
  std::atomic<bool> is_over = false;
  std::atomic<bool> is_erasing = false;
  std::vector<std::thread> threads;
  for (auto* robots : {&here, &elsewhere}) {
    for (auto& robot : *robots) {
      threads.emplace_back([&, one = robot.get()] { one->Run(is_over, is_erasing); });
    }
  }
  std::this_thread::sleep_for(std::chrono::seconds(flags.calm_s));
  is_erasing = true;
  absl::Status erased;
  const int64_t erase_ns = NanosecondsOf([&] { erased = Erase(server.address); });
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  DSG_RETURN_IF_ERROR(erased);
  report->Note(absl::StrCat("erasing ", flags.node_count, " things of ", flags.version_count,
                            " versions took ", erase_ns / 1'000'000, " ms, beside ",
                            flags.robot_count, " robots on the map and ", flags.robot_count,
                            " on others, a commit each every ", kPause.count(), " ms"));
  for (auto* robots : {&elsewhere, &here}) {
    Samples calm;
    Samples beside;
    for (const auto& robot : *robots) {
      DSG_RETURN_IF_ERROR(robot->failure());
      calm.Append(robot->calm);
      beside.Append(robot->beside);
    }
    const bool are_others = robots == &elsewhere;
    AddLines(are_others ? "other maps" : "it", calm, beside, are_others ? 100.0 : 0.0, report);
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("What robots feel of a long erasure");
  dsg::bench::Flags flags;
  app.add_option("--nodes", flags.node_count, "Things in the map that is erased from")
      ->check(CLI::Range(1, 10'000'000));
  app.add_option("--versions", flags.version_count, "Versions of each")->check(CLI::Range(1, 100));
  app.add_option("--robots", flags.robot_count, "Robots on the map, and as many on others")
      ->check(CLI::Range(1, 64));
  app.add_option("--calm", flags.calm_s, "Seconds before the erasure")->check(CLI::Range(1, 600));
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
