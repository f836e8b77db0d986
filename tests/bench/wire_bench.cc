// SPDX-License-Identifier: Apache-2.0
// The cost of the wire: every unary question to a running dsg-server beside an empty call plus the
// same question to an engine in this process, the mesh as a stream, many clients at once, and how
// soon cancelled work ends. Refuses to count a question that failed.
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <thread>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "query/engine/service_core.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/child_process.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/wire_cancel.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_questions.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

constexpr uint64_t kSeed = 20261121;
constexpr double kWireRatioMax = 1.3;
constexpr double kMeshMbPerS = 200.0;

struct Flags {
  int call_count = 1000;
  int block_count = 800;
  int client_count = 32;
  int cancel_count = 20;
  double seconds = 5.0;
  std::string listen;
  std::string only;
  std::string except;

  bool Wants(const Question& question) const {
    const std::string& name = question.name();
    return name.find(only) != std::string::npos &&
           (except.empty() || name.find(except) == std::string::npos);
  }
};

// What one question has cost, in turn, so that noise hits all three alike.
struct Costs {
  Samples engine;
  Samples server;
  Samples floor;
};

absl::Status AskInfo(const WireClient& client) {
  v1::GetServerInfoResponse info;
  return FromGrpc(Call(client.map.get(), &v1::MapService::Stub::GetServerInfo,
                       v1::GetServerInfoRequest(), &info));
}

absl::Status MeasureOnce(int i, Question* question, query::Api* engine, const WireClient& client,
                         Costs* costs) {
  absl::Status status;
  // Who comes later finds warmer caches and connections; take turns.
  for (int k = 0; k < 3; ++k) {
    absl::Status asked;
    switch ((i + k) % 3) {
      case 0:
        costs->engine.Add(NanosecondsOf([&] { asked = question->AskEngine(engine); }));
        break;
      case 1:
        costs->server.Add(NanosecondsOf([&] { asked = question->AskServer(client); }));
        break;
      default:
        costs->floor.Add(NanosecondsOf([&] { asked = AskInfo(client); }));
    }
    status.Update(asked);
  }
  if (status.ok() && question->engine_bytes() != question->server_bytes()) {
    return absl::DataLossError("the server's answer is not the engine's");
  }
  return status;
}

absl::Status MeasureQuestion(const Flags& flags, Question* question, query::Api* engine,
                             const WireClient& client, Report* report) {
  constexpr int kWarmupCount = 20;
  constexpr int64_t kMostNs = 20'000'000'000;
  Random random(kSeed, 0);
  Costs warmup;
  Costs costs;
  int64_t spent_ns = 0;
  for (int i = 0; i < kWarmupCount + flags.call_count && spent_ns < kMostNs; ++i) {
    question->Draw(&random);
    absl::Status asked;
    Costs* into = i < kWarmupCount ? &warmup : &costs;
    spent_ns += NanosecondsOf([&] { asked = MeasureOnce(i, question, engine, client, into); });
    if (!asked.ok()) {
      report->Line(absl::StrCat(question->name(), " failed: ", std::string(asked.message())), "",
                   {1.0, {}}, {}, {Target::Kind::kAtMost, 0.0});
      return absl::OkStatus();
    }
  }
  const Figure engine_us = Microseconds(costs.engine);
  const Figure floor_us = Microseconds(costs.floor);
  report->Line(question->name(), "us", Microseconds(costs.server),
               Rival{absl::StrCat("empty call ", static_cast<int>(floor_us.value), " + engine ",
                                  static_cast<int>(engine_us.value), " (p99 ",
                                  static_cast<int>(*engine_us.p99), ") ="),
                     {floor_us.value + engine_us.value, {}}},
               {Target::Kind::kRatioAtMost, kWireRatioMax});
  return absl::OkStatus();
}

absl::Status MeasureQuestions(const Flags& flags, const std::string& folder,
                              const WireClient& client, Report* report) {
  DSG_ASSIGN_OR_RETURN(auto store, GraphStore::Open(folder, {}));
  const auto engine = query::MakeServiceCore(std::move(store));
  for (const auto& question : AllQuestions()) {
    if (!flags.Wants(*question)) continue;
    DSG_RETURN_IF_ERROR(MeasureQuestion(flags, question.get(), engine.get(), client, report));
  }
  return absl::OkStatus();
}

struct MeshRun {
  int64_t bytes = 0;
  int64_t message_count = 0;
  int64_t vertex_count = 0;
  int64_t ns = 0;
};

absl::StatusOr<MeshRun> ReadMesh(const WireClient& client, bool count_bytes) {
  MeshRun run;
  grpc::Status status;
  run.ns = NanosecondsOf([&] {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    v1::GetMeshRequest request;
    request.set_map(kWireMeshMap);
    const auto reader = client.query->GetMesh(&context, request);
    v1::GetMeshResponse reply;
    while (reader->Read(&reply)) {
      ++run.message_count;
      for (const v1::MeshBlock& block : reply.blocks()) run.vertex_count += block.colors_size();
      if (count_bytes) run.bytes += static_cast<int64_t>(reply.ByteSizeLong());
    }
    status = reader->Finish();
  });
  DSG_RETURN_IF_ERROR(FromGrpc(status));
  return run;
}

absl::Status MeasureMesh(const Flags& flags, const WireClient& client, Report* report) {
  constexpr int kRunCount = 5;
  DSG_ASSIGN_OR_RETURN(const MeshRun counted, ReadMesh(client, true));
  if (counted.vertex_count != int64_t{flags.block_count} * kWireBlockVertexCount) {
    return absl::DataLossError("the stream has not the vertices of the mesh");
  }
  std::vector<double> speeds;
  for (int i = 0; i < kRunCount; ++i) {
    DSG_ASSIGN_OR_RETURN(const MeshRun run, ReadMesh(client, false));
    speeds.push_back(static_cast<double>(counted.bytes) * 1e3 / static_cast<double>(run.ns));
  }
  std::sort(speeds.begin(), speeds.end());
  report->Note(absl::StrCat("the mesh has ", counted.vertex_count, " vertices, ",
                            counted.bytes / 1'000'000, " MB on the wire in ", counted.message_count,
                            " messages; slowest run ", speeds.front(), " MB/s, fastest ",
                            speeds.back(), " MB/s"));
  report->Line("GetMesh, median", "MB/s", {speeds[speeds.size() / 2], {}}, {},
               {Target::Kind::kAtLeast, kMeshMbPerS});
  return absl::OkStatus();
}

struct Tally {
  Samples calls;
  absl::Status status;
};

void AskMixed(const Flags& flags, const WireClient& client, uint64_t stream,
              const std::atomic<bool>& stop, Tally* tally) {
  Random random(kSeed, stream);
  auto questions = AllQuestions();
  std::erase_if(questions, [&](const auto& question) { return !flags.Wants(*question); });
  while (!stop && tally->status.ok()) {
    Question* question =
        questions[static_cast<size_t>(random.Index(static_cast<int>(questions.size())))].get();
    question->Draw(&random);
    tally->calls.Add(NanosecondsOf([&] { tally->status = question->AskServer(client); }));
  }
}

absl::Status MeasureMix(const Flags& flags, const std::string& address, Report* report) {
  std::vector<WireClient> clients;
  for (int i = 0; i < flags.client_count; ++i) {
    DSG_ASSIGN_OR_RETURN(WireClient client, Connect(address));
    clients.push_back(std::move(client));
  }
  std::vector<Tally> tallies(clients.size());
  std::atomic<bool> stop{false};
  std::vector<std::thread> threads;
  for (size_t i = 0; i < clients.size(); ++i) {
    threads.emplace_back(AskMixed, std::cref(flags), std::cref(clients[i]), 100 + i,
                         std::cref(stop), &tallies[i]);
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(flags.seconds));
  stop = true;
  for (std::thread& thread : threads) thread.join();
  Samples all;
  int error_count = 0;
  for (const Tally& tally : tallies) {
    all.Append(tally.calls);
    if (!tally.status.ok()) ++error_count;
    if (!tally.status.ok()) report->Note(tally.status.ToString());
  }
  const std::string what = absl::StrCat(flags.client_count, " clients, all questions mixed, ");
  report->Line(absl::StrCat(what, all.count(), " calls, latency"), "ms", Milliseconds(all), {}, {});
  report->Line(absl::StrCat(what, "clients that met an error"), "",
               {static_cast<double>(error_count), {}}, {}, {Target::Kind::kAtMost, 0.0});
  return absl::OkStatus();
}

// The mesh, opened and then not read.
struct SilentReader {
  WireClient client;
  std::unique_ptr<grpc::ClientContext> context;
  std::unique_ptr<grpc::ClientReader<v1::GetMeshResponse>> reader;
};

absl::StatusOr<SilentReader> OpenSilent(const std::string& address) {
  SilentReader silent;
  DSG_ASSIGN_OR_RETURN(silent.client, Connect(address));
  silent.context = std::make_unique<grpc::ClientContext>();
  silent.context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  v1::GetMeshRequest request;
  request.set_map(kWireMeshMap);
  silent.reader = silent.client.query->GetMesh(silent.context.get(), request);
  v1::GetMeshResponse reply;
  if (!silent.reader->Read(&reply)) return FromGrpc(silent.reader->Finish());
  return silent;
}

absl::Status AddLocates(int count, const WireClient& client, Samples* samples) {
  const auto questions = AllQuestions();
  Random random(kSeed, 7);
  for (int i = 0; i < count; ++i) {
    absl::Status asked;
    questions.front()->Draw(&random);
    samples->Add(NanosecondsOf([&] { asked = questions.front()->AskServer(client); }));
    DSG_RETURN_IF_ERROR(asked);
  }
  return absl::OkStatus();
}

// Alone and beside readers that do not read, in turn. They leave without a word.
absl::Status MeasureSilentReaders(const std::string& address, const WireClient& client,
                                  Report* report) {
  constexpr int kRoundCount = 10;
  constexpr int kReaderCount = 16;
  Samples alone;
  Samples beside;
  DSG_RETURN_IF_ERROR(AddLocates(500, client, &alone));
  alone = Samples();
  for (int i = 0; i < kRoundCount; ++i) {
    DSG_RETURN_IF_ERROR(AddLocates(500, client, &alone));
    std::vector<SilentReader> readers;
    for (int k = 0; k < kReaderCount; ++k) {
      DSG_ASSIGN_OR_RETURN(SilentReader reader, OpenSilent(address));
      readers.push_back(std::move(reader));
    }
    // What is sent until every buffer is full is work that was asked for.
    Samples unused;
    DSG_RETURN_IF_ERROR(AddLocates(300, client, &unused));
    DSG_RETURN_IF_ERROR(AddLocates(500, client, &beside));
    for (SilentReader& reader : readers) reader.context->TryCancel();
  }
  const auto p99_us = [](const Samples& samples) { return *Microseconds(samples).p99; };
  report->Line(
      absl::StrCat("p99 of LocateAgent beside ", kReaderCount, " readers that do not read"), "us",
      {p99_us(beside), {}}, Rival{"alone", {p99_us(alone), {}}}, {Target::Kind::kRatioAtMost, 1.5});
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "wire"));
  // The path of a socket has at most 107 characters; the temporary folder's is short.
  DSG_ASSIGN_OR_RETURN(const auto socket_folder,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-bench"));
  DSG_RETURN_IF_ERROR(MakeWireWorld(folder->path(), flags.block_count));
  ShowProgress("store is made");
  const std::string address = flags.listen.empty()
                                  ? absl::StrCat("unix:", socket_folder->path(), "/server.sock")
                                  : flags.listen;
  {
    DSG_ASSIGN_OR_RETURN(
        const auto server,
        ChildServer::Start({absl::StrCat(DSG_BINARY_DIR, "/dsg-server"), "--store", folder->path(),
                            "--listen", address, "--log-level", "error"}));
    DSG_ASSIGN_OR_RETURN(const WireClient client, Connect(address));
    if (flags.call_count > 0) {
      DSG_RETURN_IF_ERROR(MeasureQuestions(flags, folder->path(), client, report));
    }
    ShowProgress("questions done");
    if (flags.block_count > 0) {
      DSG_RETURN_IF_ERROR(MeasureMesh(flags, client, report));
      DSG_RETURN_IF_ERROR(MeasureSilentReaders(address, client, report));
    }
    if (flags.seconds > 0) DSG_RETURN_IF_ERROR(MeasureMix(flags, address, report));
    ShowProgress("mesh and mix done");
  }
  if (flags.cancel_count == 0) return absl::OkStatus();
  return MeasureCancels(folder->path(), address, flags.cancel_count, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  dsg::bench::Flags flags;
  CLI::App app("Every question over the wire of a running dsg-server.", "wire_bench");
  app.add_option("--calls", flags.call_count, "Calls of each question, 0 = none")
      ->capture_default_str();
  app.add_option("--only", flags.only, "Questions whose name has this");
  app.add_option("--except", flags.except, "Not questions whose name has this");
  app.add_option("--blocks", flags.block_count, "Mesh blocks")->capture_default_str();
  app.add_option("--clients", flags.client_count, "Clients at once")->capture_default_str();
  app.add_option("--seconds", flags.seconds, "How long they ask, 0 = not")->capture_default_str();
  app.add_option("--cancels", flags.cancel_count, "Cancels of each long question, 0 = none")
      ->capture_default_str();
  app.add_option("--listen", flags.listen,
                 "Where the server listens, such as 127.0.0.1:50999; a unix socket if not given");
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
