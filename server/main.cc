// SPDX-License-Identifier: Apache-2.0
// dsg-server: serves the maps of one store folder over gRPC, and HTTP if asked to, until SIGTERM or
// SIGINT.
// Exits with 0 after an orderly stop, 2 if it could not start, 3 if it could not stop in time.
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "CLI/CLI.hpp"
#include "grpc/grpc.h"
#include "grpc/support/log.h"
#include "schema/base/allocator.h"
#include "schema/base/byte_size.h"
#include "schema/base/counted.h"
#include "schema/base/log.h"
#include "schema/base/status.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"
#include "schema/retention/policy_file.h"
#include "schema/store/graph_store.h"
#include "server/access/access_control.h"
#include "server/prune_schedule.h"
#include "server/server.h"

namespace {

constexpr std::chrono::milliseconds kGrace{4'000};
constexpr std::chrono::seconds kStopTimeMax{10};

struct Flags {
  std::string store;
  std::string log_level = "info";
  size_t view_cache_mb = 512;
  size_t open_maps_max = 16;
  size_t map_cache_mb = 64;
  size_t call_memory_mb = dsg::server::ServerOptions().call_memory_bytes >> 20;
  dsg::StoreOptions limits;
  std::string policy_file;
  std::string reflection = "local";
  dsg::server::ServerOptions options;
};

// The server keeps the digest alone.
void TellNewToken() {
  const absl::StatusOr<std::string> token = dsg::server::MakeToken();
  if (!token.ok()) throw CLI::RuntimeError(std::string(token.status().message()), 2);
  // The token alone goes into a file of its caller.
  std::printf("%s\n", token->c_str());
  std::fprintf(stderr, "for the server's access file: token_sha256: %s\n",
               dsg::server::Sha256OfToken(*token).c_str());
  throw CLI::Success();
}

void DeclareFlags(CLI::App* app, Flags* flags) {
  app->add_option("--store", flags->store, "Folder of the maps; created if missing")
      ->envname("DSG_STORE")
      ->required();
  app->add_option("--listen", flags->options.listen,
                  "unix:PATH or HOST:PORT; default unix:<store>/dsg-server.sock");
  app->add_option("--workers", flags->options.worker_count,
                  "Threads that answer calls; 0 = two per core, at least four")
      ->capture_default_str();
  app->add_option("--max-in-flight", flags->options.in_flight_max,
                  "Calls at a time; more are refused with RESOURCE_EXHAUSTED")
      ->capture_default_str();
  app->add_option("--max-streams", flags->options.open_stream_max,
                  "Streams (tracks, meshes) open at a time; more are refused")
      ->capture_default_str();
  app->add_option("--max-watches", flags->options.open_watch_max,
                  "Watches of maps open at a time; more are refused")
      ->capture_default_str();
  app->add_option("--max-connections", flags->options.connection_max,
                  "Connections at a time; more are closed at once")
      ->capture_default_str();
  app->add_option("--call-memory-mb", flags->call_memory_mb,
                  "Memory for requests and replies, MiB; calls that need more are refused")
      ->check(CLI::Range(size_t{16}, size_t{1} << 20))
      ->capture_default_str();
  app->add_option("--quota", flags->limits.quota_bytes,
                  "Largest size of a map (10GB, 500MiB); larger commits are refused; 0 = no limit")
      ->transform(CLI::Validator(dsg::TakeByteSize, "SIZE"));
  app->add_option("--reserve", flags->limits.reserve_bytes,
                  "Space reserved in each map for pruning on a full disk; 0 = none")
      ->transform(CLI::Validator(dsg::TakeByteSize, "SIZE"));
  app->add_option("--policy", flags->policy_file,
                  "File of prune policies to apply on a schedule (docs/forgetting.md)");
  app->add_option("--view-cache-mb", flags->view_cache_mb,
                  "Memory for the graphs of all maps, MiB; a larger graph is refused")
      ->check(CLI::Range(size_t{1}, size_t{1} << 24))
      ->capture_default_str();
  app->add_option("--max-open-maps", flags->open_maps_max, "Maps kept open, the most recently used")
      ->check(CLI::Range(size_t{1}, size_t{1000}))
      ->capture_default_str();
  app->add_option("--map-cache-mb", flags->map_cache_mb,
                  "Memory for the tracks and shapes of each open map, MiB")
      ->check(CLI::Range(size_t{1}, size_t{1} << 20))
      ->capture_default_str();
  app->add_option("--log-level", flags->log_level,
                  "debug (every call), info (errors and calls over 100 ms), warning, error")
      ->capture_default_str();
}

// Of an option that would otherwise switch itself off: "$UNSET" in a script.
CLI::Validator NotEmpty() {
  return CLI::Validator(
      [](const std::string& text) {
        return text.empty() ? std::string("it is empty; give a path, or leave the option out")
                            : std::string();
      },
      "FILE");
}

// Who may call, and how.
void DeclareAccessFlags(CLI::App* app, Flags* flags) {
  app->add_flag("--allow-remote", flags->options.allow_remote,
                "Listen on addresses that other machines reach, although --tls-cert or --access is "
                "missing");
  app->add_option("--access", flags->options.access_file,
                  "File that says who may call and do what (docs/access.md); read again on SIGHUP. "
                  "Without it everybody who reaches the server may do everything")
      ->check(NotEmpty());
  app->add_option(
         "--tls-cert", flags->options.tls.certificate_file,
         "Encrypt connections over TCP, gRPC and HTTP: the server's certificate, and those "
         "above it (PEM); read again on SIGHUP")
      ->check(NotEmpty());
  app->add_option("--tls-key", flags->options.tls.key_file, "Its key (PEM); only you may read it")
      ->check(NotEmpty());
  app->add_option("--tls-client-ca", flags->options.tls.client_ca_file,
                  "Let in those alone whose certificate these authorities vouch for (PEM)")
      ->check(NotEmpty());
  CLI::Option* const audit =
      app->add_option(
             "--audit", flags->options.audit_file,
             "Write who changed which map into this file, and who was refused; `dsg audit` "
             "reads it")
          ->check(NotEmpty());
  app->add_option("--audit-key", flags->options.audit_key_file,
                  "Key that seals --audit, so that who changes the file cannot hide it; only you "
                  "may read it")
      ->check(NotEmpty())
      ->needs(audit);
  app->add_option_function<std::string>(
         "--socket-mode",
         [flags](const std::string& mode) {
           flags->options.socket_mode = static_cast<unsigned>(std::stoul(mode, nullptr, 8));
         },
         "Who may connect to the unix socket: 600 its user (default), 660 its group, too, 666 all")
      ->check(CLI::IsMember({"600", "660", "666"}));
  app->add_option("--reflection", flags->reflection,
                  "Tell gRPC clients the protos: local = on a unix socket or loopback only")
      ->check(CLI::IsMember({"local", "on", "off"}))
      ->capture_default_str();
  app->add_option("--http", flags->options.http.listen,
                  "Answer over HTTP too: HOST:PORT or unix:PATH (docs/operations.md)");
  app->add_option("--http-host", flags->options.http.hosts,
                  "Another name that HTTP clients call this server by, such as that of a proxy; "
                  "may be repeated")
      ->type_name("NAME[:PORT]")
      ->allow_extra_args(false);
  app->add_flag("--http-write", flags->options.http.may_write, "Let HTTP clients change maps, too");
  app->add_flag("--http-no-token", flags->options.http.without_token,
                "Answer HTTP clients without a token: every user of this machine reads every map");
  app->add_flag_callback(
         "--new-token", TellNewToken,
         "Print a new token for a caller, and on standard error its line for --access")
      ->trigger_on_parse();
  app->set_version_flag("--version", DSG_VERSION);
}

// Running out of descriptors crashes gRPC 1.51, and the soft limit is often 1024.
void RaiseDescriptorLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0) {
    dsg::Log(dsg::LogLevel::kWarning, "descriptor limit not raised");
  }
}

void LogOfGrpc(gpr_log_func_args* args) {
  if (args->severity == GPR_LOG_SEVERITY_ERROR) {
    dsg::Log(dsg::LogLevel::kWarning, "grpc", {{"message", args->message}});
  }
}

int FailToStart(const absl::Status& status) {
  dsg::TellError("dsg-server", std::string(status.message()));
  return 2;
}

// Blocks the signals in all threads created later, so that only sigwait receives them.
sigset_t BlockStopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  // Writing beyond a limit of file sizes is an error, and no end.
  signal(SIGXFSZ, SIG_IGN);
  return signals;
}

// Ends the process if a call ignores its cancellation.
void StartWatchdog() {
  std::thread([] {
    std::this_thread::sleep_for(kStopTimeMax);
    dsg::Log(dsg::LogLevel::kError, "stop took too long", {{"exit", "3"}});
    _exit(3);
  }).detach();
}

// What was in force stays in force if the files are wrong.
void Reload(dsg::server::Server* server) {
  const absl::Status status = server->Reload();
  if (status.ok()) {
    dsg::Log(dsg::LogLevel::kInfo, "read the access file and certificates again");
  } else {
    dsg::Log(dsg::LogLevel::kError,
             "a file is not taken; of it, what was read before stays in force",
             {{"why", std::string(status.message())}});
  }
}

// The signal that ends the server.
int AwaitStop(const sigset_t& signals, dsg::server::Server* server) {
  int received = 0;
  while (sigwait(&signals, &received) != 0 || received == SIGHUP) {
    if (received == SIGHUP) Reload(server);
  }
  return received;
}

// Runs a PruneSchedule on a thread until destroyed.
class PruneThread {
 public:
  PruneThread(dsg::query::ServiceCore* core, dsg::PolicyFile file)
      : schedule_(core, std::move(file), dsg::server::PruneScheduleOptions(),
                  dsg::server::MakeScheduleClock()),
        thread_([this] { schedule_.Run(); }) {}
  ~PruneThread() {
    schedule_.Stop();
    thread_.join();
  }

 private:
  dsg::server::PruneSchedule schedule_;
  std::thread thread_;
};

// No value if `path` is empty.
absl::StatusOr<std::optional<dsg::PolicyFile>> ReadPolicies(const std::string& path) {
  if (path.empty()) return std::optional<dsg::PolicyFile>();
  DSG_ASSIGN_OR_RETURN(dsg::PolicyFile file, dsg::ReadPolicyFile(path));
  return std::optional<dsg::PolicyFile>(std::move(file));
}

dsg::server::Reflection ReflectionOf(const std::string& flag) {
  if (flag == "on") return dsg::server::Reflection::kOn;
  return flag == "off" ? dsg::server::Reflection::kOff : dsg::server::Reflection::kLocal;
}

int Serve(Flags flags) {
  const sigset_t signals = BlockStopSignals();
  RaiseDescriptorLimit();
  gpr_set_log_function(LogOfGrpc);
  // Has no grpc_shutdown: the last one waits up to 10 s for a poller that gRPC 1.51 starts when a
  // reader is slow, and the process ends anyway.
  grpc_init();
  auto policies = ReadPolicies(flags.policy_file);
  if (!policies.ok()) return FailToStart(policies.status());
  dsg::StoreOptions store_options = flags.limits;
  store_options.create = true;
  store_options.program = "dsg-server";
  store_options.cache_bytes = flags.map_cache_mb << 20;
  const bool is_new = !std::filesystem::exists(flags.store);
  auto store = dsg::OpenStore(flags.store, store_options);
  if (!store.ok()) return FailToStart(store.status());
  const auto maps = (*store)->ListMaps();
  if (!maps.ok()) return FailToStart(maps.status());

  if (flags.options.listen.empty())
    flags.options.listen = "unix:" + flags.store + "/dsg-server.sock";
  flags.options.call_memory_bytes = flags.call_memory_mb << 20;
  flags.options.reflection = ReflectionOf(flags.reflection);
  flags.options.log_all_calls = flags.log_level == "debug";
  dsg::query::ServiceCoreOptions core_options;
  core_options.view_cache_bytes = flags.view_cache_mb << 20;
  core_options.open_maps_max = flags.open_maps_max;
  auto core = dsg::query::MakeServiceCore(*std::move(store), core_options);
  dsg::query::ServiceCore* const kept_core = core.get();
  auto server = dsg::server::Server::Start(std::move(core), flags.options);
  if (!server.ok()) return FailToStart(server.status());
  std::optional<PruneThread> pruning;
  if (policies->has_value()) pruning.emplace(kept_core, **std::move(policies));
  std::printf("dsg-server: listening on %s, store %s%s, %s\n", (*server)->address().c_str(),
              flags.store.c_str(), is_new ? " (new: it did not exist)" : "",
              dsg::Counted(static_cast<int64_t>(maps->size()), "map").c_str());
  if (const std::string url = (*server)->http_url(); !url.empty()) {
    std::printf("dsg-server: HTTP on %s\n", url.c_str());
  }
  std::fflush(stdout);

  const int received = AwaitStop(signals, server->get());
  dsg::Log(dsg::LogLevel::kInfo, "stopping", {{"signal", strsignal(received)}});
  StartWatchdog();
  pruning.reset();
  (*server)->Shutdown(kGrace);
  // Closes the store and releases its writer locks.
  server->reset();
  dsg::Log(dsg::LogLevel::kInfo, "stopped");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  // Some messages of a stream.
  dsg::KeepFreedMemory(size_t{16} << 20);
  Flags flags;
  CLI::App app("Serves the maps of a store folder over gRPC, and over HTTP if asked to.",
               "dsg-server");
  DeclareFlags(&app, &flags);
  DeclareAccessFlags(&app, &flags);
  dsg::AddManual(&app, DSG_VERSION);
  if (const std::optional<int> end = dsg::ReadCommandLine(argc, argv, &app)) return *end;
  if (!dsg::SetLogLevel(flags.log_level)) {
    dsg::TellError("dsg-server", absl::StrCat("--log-level is \"", flags.log_level,
                                              "\"; give debug, info, warning or error"));
    return 2;
  }
  return Serve(std::move(flags));
}
