// SPDX-License-Identifier: Apache-2.0
// What hostile clients cost a dsg-server and everybody else: the most memory that it has, and the
// latency of LocateAgent on another connection, in an attack and without. The server is started
// anew for each, and the attackers are a process of their own. Refuses to go on without the server.
#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <thread>
#include <utility>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "grpcpp/generic/generic_stub.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/bench/child_process.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_questions.h"
#include "tests/bench/wire_server.h"
#include "tests/bench/wire_world.h"
#include "tests/support/raw_http2.h"

namespace dsg::bench {
namespace {

using std::chrono::seconds;
using std::chrono::system_clock;
using Clock = std::chrono::steady_clock;

constexpr char kAttackFlag[] = "--be-attackers";
constexpr uint64_t kSeed = 41;
constexpr int kClientCount = 32;
constexpr int kSlowCallCount = 8;
constexpr int kSlowPathCount = 50;
constexpr int kResetCount = 150'000;
constexpr double kMebibyte = 1 << 20;
constexpr double kResidentMiBMax = 1024.0;
constexpr double kRatioMax = 2.0;

// Just under four mebibytes of empty messages in a list, within a message if `outer_tag` is given.
std::string EmptyMessages(char tag, char outer_tag) {
  constexpr uint32_t kCount = 2'000'000;
  std::string bytes;
  if (outer_tag != 0) {
    bytes.push_back(outer_tag);
    for (uint32_t left = 2 * kCount; left > 0; left >>= 7) {
      bytes.push_back(static_cast<char>((left & 0x7f) | (left >= 0x80 ? 0x80 : 0)));
    }
  }
  for (uint32_t i = 0; i < kCount; ++i) bytes.append({tag, '\0'});
  return bytes;
}

std::string SlowPaths() {
  Random random(kSeed, 0);
  v1::PlanPathsRequest request;
  request.set_map(kWireMap);
  // About a tenth of a second each, so that eight of them leave others their turn.
  for (int i = 0; i < kSlowPathCount; ++i) {
    v1::PlanPathRequest* const path = request.add_paths();
    for (v1::Vector3* const end :
         {path->mutable_from()->mutable_position(), path->mutable_to()->mutable_position()}) {
      end->set_x(random.Uniform(1, 48));
      end->set_y(random.Uniform(1, 48));
      end->set_z(random.Uniform(0.5, 4));
    }
    path->set_mode(v1::FLAT);
  }
  return request.SerializeAsString();
}

// Sends the same bytes again and again as requests to `path`, on a connection of its own.
void SendBytes(const std::string& address, const std::string& path, const std::string& bytes,
               Clock::time_point end) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  grpc::GenericStub stub(
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::CompletionQueue queue;
  while (Clock::now() < end) {
    grpc::ClientContext context;
    context.set_deadline(system_clock::now() + seconds(20));
    grpc::ByteBuffer reply;
    grpc::Status status;
    const auto call = stub.PrepareUnaryCall(&context, path, request, &queue);
    call->StartCall();
    call->Finish(&reply, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
  }
}

void SendFromMany(const std::string& address, const std::string& path, const std::string& bytes,
                  int count, Clock::time_point end, std::vector<std::thread>* threads) {
  for (int i = 0; i < count; ++i) {
    threads->emplace_back([=] { SendBytes(address, path, bytes, end); });
  }
}

void FloodOnce(const std::string& address) {
  test::RawHttp2 connection(address);
  if (!connection.SendPreface()) return;
  const int sent =
      test::FloodWithResets(&connection, "/dsg.v1.QueryService/LocateAgent", kResetCount);
  std::fprintf(stderr, "%d of %d resets were sent\n", sent, kResetCount);
}

struct Attack {
  const char* name;
  const char* what;
};

constexpr Attack kAttacks[] = {
    {"commits", "32 clients that commit 4 MiB of empty nodes"},
    {"paths", "32 clients that ask for 4 MiB of empty paths, beside eight slow calls"},
    {"resets", "150,000 resets on one connection"},
};

// The work of the other process.
void Perform(const std::string& name, const std::string& address, Clock::time_point end) {
  std::vector<std::thread> threads;
  if (name == "commits") {
    SendFromMany(address, "/dsg.v1.IngestService/Commit", EmptyMessages('\x52', '\x0a'),
                 kClientCount, end, &threads);
  } else if (name == "paths" || name == "slow") {
    const char path[] = "/dsg.v1.QueryService/PlanPaths";
    SendFromMany(address, path, SlowPaths(), kSlowCallCount, end, &threads);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    if (name == "paths") {
      SendFromMany(address, path, EmptyMessages('\x1a', 0), kClientCount, end, &threads);
    }
  } else {
    FloodOnce(address);
  }
  for (std::thread& thread : threads) thread.join();
}

struct Outcome {
  Samples latency;
  int failed_count = 0;
  int64_t resident_bytes_max = 0;
};

// LocateAgent for a while, each from a connection that lives through it.
absl::StatusOr<Outcome> AskAWhile(const WireServer& server, double time_s, uint64_t stream) {
  DSG_ASSIGN_OR_RETURN(const WireClient client, Connect(server.address));
  const auto questions = QuestionsWanted({"LocateAgent", "Batch"});
  Question* const question = questions.front().get();
  Random random(kSeed, stream);
  Outcome outcome;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(time_s));
  while (Clock::now() < end) {
    absl::Status asked;
    question->Draw(&random);
    outcome.latency.Add(NanosecondsOf([&] { asked = question->AskServer(client); }));
    if (!asked.ok() && outcome.failed_count++ == 0) {
      std::fprintf(stderr, "a bystander got %s\n", asked.ToString().c_str());
    }
    // As a person asks, not as a load: what is measured is waiting.
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  outcome.resident_bytes_max = server.process->ResidentBytesMax();
  return outcome;
}

void ReportOutcome(const std::string& what, const Outcome& alone, const Outcome& beside,
                   Report* report) {
  report->Line(absl::StrCat("most memory of the server, ", what), "MiB",
               {static_cast<double>(beside.resident_bytes_max) / kMebibyte, {}},
               Rival{"alone", {static_cast<double>(alone.resident_bytes_max) / kMebibyte, {}}},
               {Target::Kind::kAtMost, kResidentMiBMax});
  report->Line(absl::StrCat("p99 of LocateAgent beside, ", what), "us",
               {*Microseconds(beside.latency).p99, {}},
               Rival{"without", {*Microseconds(alone.latency).p99, {}}},
               {Target::Kind::kRatioAtMost, kRatioMax});
  report->Line(absl::StrCat("calls of others that failed, ", what), "calls",
               {static_cast<double>(beside.failed_count), {}}, std::nullopt,
               {Target::Kind::kAtMost, 0.0});
}

struct Flags {
  double seconds = 10.0;
  std::string only;
  std::string server;
  bool with_control = false;
  bool is_apart = false;
};

// Binds this process, and those that it starts, to the first processor or to all but the first.
// Apart, attackers take no processor time from the server; but on two processors the server and
// those who ask it beside the attack share one.
absl::Status Bind(bool to_first) {
  cpu_set_t processors;
  CPU_ZERO(&processors);
  const long count = sysconf(_SC_NPROCESSORS_ONLN);
  for (long i = to_first ? 0 : 1; i < (to_first ? 1 : count); ++i) CPU_SET(i, &processors);
  if (sched_setaffinity(0, sizeof processors, &processors) == 0) return absl::OkStatus();
  return absl::FailedPreconditionError("--apart needs two processors");
}

absl::StatusOr<std::unique_ptr<ChildServer>> StartAttackers(const std::string& name,
                                                            const std::string& address,
                                                            const Flags& flags) {
  return ChildServer::Start({"/proc/self/exe", kAttackFlag, name, address,
                             absl::StrCat(flags.seconds), flags.is_apart ? "apart" : "beside"});
}

// Others' latency while the attack goes to a server that they do not ask: what remains of it is due
// to the processors, which all of them share here.
absl::StatusOr<Outcome> AskBesideAnother(const Attack& attack, const Flags& flags,
                                         const WireServer& server) {
  DSG_ASSIGN_OR_RETURN(const auto folder,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-bench"));
  const WirePlace elsewhere{folder->path(), absl::StrCat("unix:", folder->path(), "/s.sock")};
  DSG_RETURN_IF_ERROR(MakeWireWorld(elsewhere.store, 1));
  DSG_ASSIGN_OR_RETURN(const WireServer attacked, StartWireServer(elsewhere, {}, flags.server));
  DSG_ASSIGN_OR_RETURN(const auto attackers, StartAttackers(attack.name, attacked.address, flags));
  return AskAWhile(server, flags.seconds, 4);
}

absl::Status MeasureAttack(const Attack& attack, const Flags& flags, const WirePlace& place,
                           Report* report) {
  DSG_ASSIGN_OR_RETURN(const WireServer server, StartWireServer(place, {}, flags.server));
  DSG_RETURN_IF_ERROR(AskAWhile(server, 1.0, 1).status());
  // The slow calls are everyday work: others are compared with what they see beside those.
  std::unique_ptr<ChildServer> slow;
  if (std::strcmp(attack.name, "paths") == 0) {
    DSG_ASSIGN_OR_RETURN(slow, StartAttackers("slow", server.address, flags));
  }
  DSG_ASSIGN_OR_RETURN(const Outcome alone, AskAWhile(server, flags.seconds, 2));
  slow = nullptr;
  DSG_ASSIGN_OR_RETURN(auto attackers, StartAttackers(attack.name, server.address, flags));
  DSG_ASSIGN_OR_RETURN(const Outcome beside, AskAWhile(server, flags.seconds, 3));
  ReportOutcome(attack.what, alone, beside, report);
  if (!flags.with_control) return absl::OkStatus();
  attackers = nullptr;
  DSG_ASSIGN_OR_RETURN(const Outcome elsewhere, AskBesideAnother(attack, flags, server));
  report->Line(absl::StrCat("p99 of LocateAgent beside, on another server, ", attack.what), "us",
               {*Microseconds(elsewhere.latency).p99, {}},
               Rival{"without", {*Microseconds(alone.latency).p99, {}}}, {});
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  if (flags.is_apart) DSG_RETURN_IF_ERROR(Bind(/*to_first=*/false));
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "hostile"));
  DSG_ASSIGN_OR_RETURN(const auto socket_folder,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-bench"));
  DSG_RETURN_IF_ERROR(MakeWireWorld(folder->path(), 1));
  ShowProgress("store is made");
  const WirePlace place{folder->path(), absl::StrCat("unix:", socket_folder->path(), "/s.sock")};
  for (const Attack& attack : kAttacks) {
    if (!flags.only.empty() && flags.only != attack.name) continue;
    const absl::Status measured = MeasureAttack(attack, flags, place, report);
    if (!measured.ok()) {
      return absl::Status(measured.code(),
                          absl::StrCat(attack.what, ": ", std::string(measured.message())));
    }
    ShowProgress(absl::StrCat(attack.name, " done"));
  }
  return absl::OkStatus();
}

// What the process does that is started with the flag, the attack, the address, a time, and
// whether it has a processor of its own.
bool BeAttackers(int argc, char** argv) {
  if (argc != 6 || std::strcmp(argv[1], kAttackFlag) != 0) return false;
  if (std::strcmp(argv[5], "apart") == 0 && !Bind(/*to_first=*/true).ok()) return true;
  std::printf("ready\n");
  std::fflush(stdout);
  const std::chrono::duration<double> time(std::atof(argv[4]));
  Perform(argv[2], argv[3], Clock::now() + std::chrono::duration_cast<Clock::duration>(time));
  return true;
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  if (dsg::bench::BeAttackers(argc, argv)) return 0;
  dsg::bench::Flags flags;
  CLI::App app("Hostile clients: what they cost the server and others.", "hostile_bench");
  app.add_option("--seconds", flags.seconds, "How long others ask, with the attack and without")
      ->capture_default_str();
  app.add_option("--only", flags.only, "commits, paths or resets; all if not given");
  app.add_flag(
      "--control", flags.with_control,
      "Also ask while the attack goes to a second server, which shares only the processors");
  app.add_flag("--apart", flags.is_apart,
               "Give attackers and slow calls the first processor, and the server and others the "
               "rest, with the attack and without");
  app.add_option("--server", flags.server, "The dsg-server to attack; default the one built here");
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
