// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "grpcpp/grpcpp.h"
#include "grpcpp/server_posix.h"
#include "schema/base/log.h"
#include "schema/base/status.h"
#include "server/call_runtime.h"
#include "server/connection_front.h"
#include "server/grpc_services.h"
#include "server/http/http_port.h"
#include "server/listen.h"
#include "server/method_table.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

// Commits wait for the disk and for other commits to the same map; they must not take the workers
// of questions. Each has its own worker, so that commits to a map under erasure do not delay
// commits to another map.
constexpr int kCommitsInFlightMax = 32;
constexpr int kCommitWorkerCount = kCommitsInFlightMax;
// Commits wait for the disk anyway; questions wait for the processor only.
constexpr int kCommitNiceness = 5;
// At most 4 MiB each.
constexpr int kArrivalsMax = 64;

// For answers on their way through TLS when all calls have ended.
constexpr std::chrono::milliseconds kLastBytesMax{500};

// Other machines may reach what is encrypted and asks who calls.
bool IsGuarded(const ServerOptions& options) {
  return !options.tls.certificate_file.empty() &&
         (!options.access_file.empty() || !options.tls.client_ca_file.empty());
}

int WorkerCount(int asked) {
  if (asked > 0) return asked;
  return std::max(4, 2 * static_cast<int>(std::thread::hardware_concurrency()));
}

// Limits what a peer may do. The defaults of gRPC 1.51 trust peers too much.
void SetLimits(grpc::ServerBuilder* builder) {
  builder->SetMaxReceiveMessageSize(kMessageBytesMaxOnWire);
  builder->SetMaxSendMessageSize(kMessageBytesMaxOnWire);
  // gRPC checks the message limit after inflating: 1 MiB of gzip can become 1 GiB of memory.
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  // A long read keeps a processor from shorter calls.
  builder->AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, 32 << 10);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 64);
  builder->AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8 << 10);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 3);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, 600'000);
}

absl::Status CheckRange(const std::string& option, int value, int min, int max) {
  if (value >= min && value <= max) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(option, " is ", value, "; give ", min, " to ", max),
                   {{"field", option}, {"value", absl::StrCat(value)}});
}

absl::Status CheckSocketMode(const ServerOptions& options) {
  if (options.socket_mode == ServerOptions().socket_mode || !options.access_file.empty()) {
    return absl::OkStatus();
  }
  return MakeError(Reason::kFieldInvalid,
                   "--socket-mode lets others connect, and without --access each of them may do "
                   "everything; give --access",
                   {{"field", "socket-mode"}, {"value", ""}});
}

absl::Status CheckTls(const TlsOptions& tls) {
  const bool is_whole = tls.certificate_file.empty() == tls.key_file.empty();
  if (is_whole && (tls.client_ca_file.empty() || !tls.certificate_file.empty())) {
    return absl::OkStatus();
  }
  return MakeError(Reason::kFieldInvalid,
                   "TLS needs a certificate and its key; give --tls-cert and --tls-key",
                   {{"field", "tls-cert"}, {"value", tls.certificate_file}});
}

absl::Status CheckHttp(const HttpOptions& http) {
  for (const std::string& name : http.hosts) {
    constexpr char kHostCharacters[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:[]";
    if (!name.empty() && name.find_first_not_of(kHostCharacters) == std::string::npos) continue;
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("\"", name,
                                  "\" is no name of a host; give --http-host NAME or NAME:PORT, as "
                                  "in the addresses that clients use"),
                     {{"field", "http-host"}, {"value", name}});
  }
  const bool has_more = !http.hosts.empty() || http.may_write || http.without_token;
  if (!http.listen.empty() || !has_more) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   "there are options of the HTTP port, but no HTTP port; give its address by "
                   "--http, or leave them out",
                   {{"field", "http"}, {"value", ""}});
}

// Half of the descriptors are left for the files of maps and for gRPC.
int ConnectionMax(int asked) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return asked;
  return static_cast<int>(std::clamp<rlim_t>(limit.rlim_cur / 2, 1, static_cast<rlim_t>(asked)));
}

ConnectionLimits LimitsOfConnections(const ServerOptions& options) {
  ConnectionLimits limits;
  limits.connection_max = ConnectionMax(options.connection_max);
  // Calls whose deadlines pass in the queue must not close their connection.
  limits.call_max += options.in_flight_max;
  return limits;
}

class RunningServer final : public Server {
 public:
  RunningServer(std::unique_ptr<query::ServiceCore> core, const ServerOptions& options)
      : core_(std::move(core)),
        workers_(WorkerCount(options.worker_count), options.in_flight_max),
        commit_workers_(kCommitWorkerCount, std::min(options.in_flight_max, kCommitsInFlightMax),
                        kCommitNiceness),
        delays_(&timer_, &workers_),
        guard_(&timer_, options.reader_stall_max),
        connections_(LimitsOfConnections(options)),
        arrivals_(kArrivalsMax),
        memory_(options.call_memory_bytes),
        methods_(&questions_, &commits_),
        grpc_services_(&methods_) {
    Prepare(options, &workers_, &questions_);
    Prepare(options, &commit_workers_, &commits_);
  }

  ~RunningServer() override { Shutdown(std::chrono::seconds(1)); }

  absl::Status Listen(const ServerOptions& options) {
    DSG_ASSIGN_OR_RETURN(access_, AccessControl::Open(options.access_file));
    questions_.access = commits_.access = access_.get();
    if (access_->names_certificates() && options.tls.client_ca_file.empty()) {
      Log(LogLevel::kWarning,
          "the access file knows callers by certificates, and none is asked for without "
          "--tls-client-ca");
    }
    DSG_ASSIGN_OR_RETURN(audit_, CallAudit::Open(options.audit_file, options.audit_key_file));
    questions_.audit = commits_.audit = audit_.get();
    DSG_ASSIGN_OR_RETURN(front_, ConnectionFront::Open(options.tls, options.connection_max));
    const bool allow_remote = options.allow_remote || IsGuarded(options);
    DSG_ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(options.listen, allow_remote));
    if (address.is_unix()) {
      DSG_ASSIGN_OR_RETURN(claim_, UnixSocketClaim::Take(address.socket_path));
    }
    DSG_ASSIGN_OR_RETURN(acceptor_, Acceptor::Listen(address, options.socket_mode));
    if (!options.http.listen.empty()) {
      DSG_ASSIGN_OR_RETURN(http_port_,
                           HttpPort::Listen(options.http, allow_remote, options.reader_stall_max,
                                            &methods_, &questions_, front_.get()));
    }
    grpc::ServerBuilder builder;
    SetLimits(&builder);
    const bool is_for_all = options.reflection == Reflection::kOn;
    const bool is_for_local = options.reflection == Reflection::kLocal && address.is_local();
    grpc_services_.AddTo(&builder, is_for_all || is_for_local);
    grpc_server_ = builder.BuildAndStart();
    if (grpc_server_ == nullptr) {
      return absl::InternalError("gRPC did not start; see its log");
    }
    grpc_services_.ReportServing(grpc_server_.get());
    acceptor_->Start([this](int fd, const std::string& peer) {
      front_->Pass(
          fd, acceptor_->address().is_unix(), ConnectionFront::Protocol::kGrpc, peer,
          [this, peer](int plain_fd, const Peer& identity) { TakeGrpc(plain_fd, peer, identity); });
    });
    address_ = acceptor_->address().ToString();
    if (http_port_ != nullptr) http_port_->Start();
    return absl::OkStatus();
  }

  const std::string& address() const override { return address_; }
  std::string http_url() const override { return http_port_ == nullptr ? "" : http_port_->url(); }

  ServerLoad Load() const override {
    const auto [running_count, queued_count] = workers_.Load();
    return {running_count, queued_count, questions_.open_stream_count, questions_.open_watch_count};
  }

  absl::Status Reload() override {
    // Each for itself: a typing error in one file must not let a certificate expire.
    absl::Status status = access_->Reload();
    for (const absl::Status& other : {front_->Reload(), audit_->Reload()}) {
      if (!other.ok())
        status = status.ok() ? other : Annotate(status, std::string(other.message()));
    }
    return status;
  }

  void Shutdown(std::chrono::milliseconds grace) override {
    if (grpc_server_ != nullptr) {
      acceptor_->Stop();
      grpc_server_->GetHealthCheckService()->Shutdown();
      // Nothing else ends watches, which would use up the grace.
      questions_.stopping = true;
      commits_.stopping = true;
      delays_.HurryAll();
      if (http_port_ != nullptr) http_port_->BeginShutdown(grace);
      // Waits for every call. Calls that run past the grace are cancelled and then finish.
      grpc_server_->Shutdown(std::chrono::system_clock::now() + grace);
      grpc_server_->Wait();
      if (http_port_ != nullptr) http_port_->Join();
      front_->Stop(kLastBytesMax);
      // The timer may still hold a call that the guard has just ended.
      timer_.Stop();
      grpc_server_ = nullptr;
    }
    timer_.Stop();
    workers_.Stop();
    commit_workers_.Stop();
    claim_ = nullptr;
  }

 private:
  void TakeGrpc(int fd, const std::string& peer, const Peer& identity) {
    if (connections_.Add(fd, peer, identity) != nullptr) {
      grpc::AddInsecureChannelFromFd(grpc_server_.get(), fd);
    } else {
      close(fd);
    }
  }

  void Prepare(const ServerOptions& options, WorkerPool* workers, CallRuntime* runtime) {
    runtime->core = core_.get();
    runtime->store_folder = core_->store_folder();
    runtime->workers = workers;
    runtime->guard = &guard_;
    runtime->log = CallLog(options.log_all_calls);
    runtime->open_stream_max = options.open_stream_max;
    runtime->connections = &connections_;
    runtime->arrivals = &arrivals_;
    runtime->memory = &memory_;
    runtime->blocks = &blocks_;
    runtime->delays = &delays_;
    runtime->open_watch_max = options.open_watch_max;
  }

  // Ordered by dependence: later members use earlier ones and are destroyed first.
  std::unique_ptr<query::ServiceCore> core_;
  std::unique_ptr<UnixSocketClaim> claim_;
  std::unique_ptr<AccessControl> access_;
  std::unique_ptr<CallAudit> audit_;
  WorkerPool workers_;
  WorkerPool commit_workers_;
  Timer timer_;
  DelayQueue delays_;
  CallGuard guard_;
  Connections connections_;
  Arrivals arrivals_;
  CallMemory memory_;
  ArenaBlocks blocks_;
  CallRuntime questions_;
  CallRuntime commits_;
  MethodTable methods_;
  GrpcServices grpc_services_;
  std::unique_ptr<HttpPort> http_port_;
  std::unique_ptr<Acceptor> acceptor_;
  std::string address_;
  std::unique_ptr<grpc::Server> grpc_server_;
  // Its threads hand connections to all of the above.
  std::unique_ptr<ConnectionFront> front_;
};

}  // namespace

absl::Status OverloadedError(std::string_view why) {
  // Long enough for several calls to finish.
  constexpr int kRetryAfterMs = 200;
  return MakeError(
      Reason::kOverloaded,
      absl::StrCat(std::string(why), "; retry after a growing pause from ", kRetryAfterMs,
                   " ms, and use batch calls instead of many small ones"),
      {{"retry_after_ms", absl::StrCat(kRetryAfterMs)}});
}

absl::Status TooManyWatchesError(int watch_max) {
  return MakeError(Reason::kOverloaded,
                   absl::StrCat("the server keeps ", watch_max,
                                " watches at a time, and all are in use; end one, use "
                                "ListRevisions instead, or start the server with --max-watches"),
                   {{"watches", absl::StrCat(watch_max)}});
}

absl::Status UnknownMethodError(std::string_view path) {
  return absl::UnimplementedError(
      absl::StrCat("no method ", CutText(path, kMessageBytesMax / 2), "; see proto/dsg/v1"));
}

absl::Status ShuttingDownError() {
  return MakeError(Reason::kShuttingDown,
                   "the server is stopping; call again when it is back: resume a watch from the "
                   "last read_revision, and repeat maintenance to do the rest");
}

absl::Status ServerOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckHttp(http));
  DSG_RETURN_IF_ERROR(CheckTls(tls));
  DSG_RETURN_IF_ERROR(CheckSocketMode(*this));
  DSG_RETURN_IF_ERROR(CheckRange("workers", worker_count, 0, 256));
  DSG_RETURN_IF_ERROR(CheckRange("max-in-flight", in_flight_max, 1, 65536));
  DSG_RETURN_IF_ERROR(CheckRange("max-streams", open_stream_max, 1, 65536));
  DSG_RETURN_IF_ERROR(CheckRange("max-watches", open_watch_max, 0, 65536));
  DSG_RETURN_IF_ERROR(CheckRange("max-connections", connection_max, 1, 65536));
  DSG_RETURN_IF_ERROR(
      CheckRange("call-memory-mb", static_cast<int>(call_memory_bytes >> 20), 16, 1 << 20));
  if (reader_stall_max >= std::chrono::milliseconds(1) &&
      reader_stall_max <= std::chrono::hours(1)) {
    return absl::OkStatus();
  }
  const std::string ms = absl::StrCat(reader_stall_max.count());
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("reader stall is ", ms, " ms; give 1 ms to an hour"),
                   {{"field", "reader_stall_max"}, {"value", ms}});
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(std::unique_ptr<query::ServiceCore> core,
                                                      const ServerOptions& options) {
  DSG_RETURN_IF_ERROR(options.Validate());
  auto server = std::make_unique<RunningServer>(std::move(core), options);
  DSG_RETURN_IF_ERROR(server->Listen(options));
  return std::unique_ptr<Server>(std::move(server));
}

}  // namespace dsg::server
