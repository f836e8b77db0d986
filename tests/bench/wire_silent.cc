// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_silent.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/bench/wire_questions.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

constexpr char kSilentFlag[] = "--be-silent-readers";
constexpr uint64_t kSeed = 20261121;
constexpr int kReaderCount = 16;
constexpr int kRoundCount = 10;
constexpr int kCallCount = 500;
constexpr double kRatioMax = 1.5;

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

absl::Status OpenAndWait(const std::string& address, int reader_count) {
  std::vector<SilentReader> readers;
  for (int i = 0; i < reader_count; ++i) {
    DSG_ASSIGN_OR_RETURN(SilentReader reader, OpenSilent(address));
    readers.push_back(std::move(reader));
  }
  std::printf("ready\n");
  std::fflush(stdout);
  // Ended by a signal, without a word to the server.
  while (true) pause();
}

// What calls have cost.
struct Costs {
  Samples latency;
  int64_t server_cpu_ns = 0;

  Figure p99_us() const { return {*Microseconds(latency).p99, {}}; }
  Figure cpu_us() const {
    return {static_cast<double>(server_cpu_ns) / 1e3 / static_cast<double>(latency.count()), {}};
  }
};

absl::Status AddLocates(const WireServer& server, const WireClient& client, Question* question,
                        Random* random, Costs* costs) {
  const int64_t before_ns = server.process->CpuNs();
  for (int i = 0; i < kCallCount; ++i) {
    absl::Status asked;
    question->Draw(random);
    costs->latency.Add(NanosecondsOf([&] { asked = question->AskServer(client); }));
    DSG_RETURN_IF_ERROR(asked);
  }
  costs->server_cpu_ns += server.process->CpuNs() - before_ns;
  return absl::OkStatus();
}

// Until the server has nothing to do any more.
void WaitForQuiet(const WireServer& server) {
  constexpr int kLookCount = 200;
  constexpr std::chrono::milliseconds kPeriod{20};
  constexpr int64_t kQuietNs = 500'000;
  int64_t before_ns = server.process->CpuNs();
  for (int i = 0; i < kLookCount; ++i) {
    std::this_thread::sleep_for(kPeriod);
    const int64_t now_ns = server.process->CpuNs();
    if (now_ns - before_ns < kQuietNs) return;
    before_ns = now_ns;
  }
}

}  // namespace

bool BeSilentReaders(int argc, char** argv, int* exit_code) {
  if (argc != 4 || std::strcmp(argv[1], kSilentFlag) != 0) return false;
  const absl::Status status = OpenAndWait(argv[2], std::atoi(argv[3]));
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  *exit_code = 2;
  return true;
}

absl::Status MeasureSilentReaders(const WireServer& server, const WireClient& client,
                                  Report* report) {
  const auto questions = QuestionsWanted({"LocateAgent", "Batch"});
  Question* const question = questions.front().get();
  Random random(kSeed, 7);
  Costs warmup;
  Costs alone;
  Costs beside;
  DSG_RETURN_IF_ERROR(AddLocates(server, client, question, &random, &warmup));
  for (int i = 0; i < kRoundCount; ++i) {
    WaitForQuiet(server);
    DSG_RETURN_IF_ERROR(AddLocates(server, client, question, &random, &alone));
    DSG_ASSIGN_OR_RETURN(const auto readers,
                         ChildServer::Start({"/proc/self/exe", kSilentFlag, server.address,
                                             absl::StrCat(kReaderCount)}));
    WaitForQuiet(server);
    DSG_RETURN_IF_ERROR(AddLocates(server, client, question, &random, &beside));
  }
  const std::string what =
      absl::StrCat(" LocateAgent beside ", kReaderCount, " readers that do not read");
  report->Line(absl::StrCat("p99 of", what), "us", beside.p99_us(), Rival{"alone", alone.p99_us()},
               {Target::Kind::kRatioAtMost, kRatioMax});
  report->Line(absl::StrCat("processor time of the server for a", what), "us", beside.cpu_us(),
               Rival{"alone", alone.cpu_us()}, {Target::Kind::kRatioAtMost, kRatioMax});
  return absl::OkStatus();
}

}  // namespace dsg::bench
