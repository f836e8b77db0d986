// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "grpcpp/ext/health_check_service_server_builder_option.h"
#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/grpcpp.h"
#include "grpcpp/server_posix.h"
#include "query/api/api.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "server/call_runtime.h"
#include "server/listen.h"
#include "server/stream_call.h"
#include "server/unary_call_internal.h"

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

class UnknownMethod final : public grpc::ServerGenericBidiReactor {
 public:
  explicit UnknownMethod(const std::string& path) {
    Finish(grpc::Status(grpc::StatusCode::UNIMPLEMENTED,
                        absl::StrCat("no method ", path, "; see proto/dsg/v1")));
  }
  void OnDone() override { delete this; }
};

// The methods of dsg.v1 as gRPC sees them: each path begins a call. gRPC hands over bytes instead
// of messages, so that a request is charged for before it is parsed.
class Services final : public grpc::CallbackGenericService {
 public:
  using Context = grpc::GenericCallbackServerContext;

  /// `questions` serves the methods that read, `commits` those that write and may wait for the
  /// disk. Both must outlive the service and all calls.
  Services(CallRuntime* questions, CallRuntime* commits) {
    query::ForEachMethod([&](const query::MethodInfo& info, auto ask) {
      // Maintenance shares the workers of commits: it writes too and may wait for commits.
      Add(info, ask, info.writes ? commits : questions);
    });
  }

  grpc::ServerGenericBidiReactor* CreateReactor(Context* context) override {
    const auto found = methods_.find(context->method());
    if (found == methods_.end()) return new UnknownMethod(context->method());
    return found->second.begin(context);
  }

 private:
  struct Entry {
    std::unique_ptr<Method> method;
    std::function<grpc::ServerGenericBidiReactor*(Context*)> begin;
  };

  template <typename Request, typename Reply>
  void Add(const query::MethodInfo& info, AskUnary<Request, Reply> ask, CallRuntime* runtime) {
    Add(std::make_unique<Method>(info, Request::descriptor()),
        [=](const Method* method, Context* context) {
          return new UnaryCall<Request, Reply>(runtime, method, ask, context);
        });
  }

  template <typename Request, typename Reply>
  void Add(const query::MethodInfo& info, OpenStream<Request, Reply> open, CallRuntime* runtime) {
    Add(std::make_unique<Method>(info, Request::descriptor()),
        [=](const Method* method, Context* context) {
          return new StreamCall<Request, Reply>(runtime, method, open, context);
        });
  }

  // `begin` gets the method, whose address is stable.
  template <typename Begin>
  void Add(std::unique_ptr<Method> method, const Begin& begin) {
    const Method* const kept = method.get();
    std::string path = absl::StrCat("/dsg.v1.", std::string(kept->info.service), "/",
                                    std::string(kept->info.name));
    Entry entry{std::move(method),
                [begin, kept](Context* context) { return begin(kept, context); }};
    const bool is_new = methods_.emplace(std::move(path), std::move(entry)).second;
    DSG_CHECK(is_new);
  }

  // By path: "/dsg.v1.MapService/ListMaps".
  std::unordered_map<std::string, Entry> methods_;
};

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
        services_(&questions_, &commits_) {
    Prepare(options, &workers_, &questions_);
    Prepare(options, &commit_workers_, &commits_);
  }

  ~RunningServer() override { Shutdown(std::chrono::seconds(1)); }

  absl::Status Listen(const ServerOptions& options) {
    DSG_ASSIGN_OR_RETURN(ListenAddress address,
                         ParseListenAddress(options.listen, options.allow_remote));
    if (address.is_unix()) {
      DSG_ASSIGN_OR_RETURN(claim_, UnixSocketClaim::Take(address.socket_path));
    }
    DSG_ASSIGN_OR_RETURN(acceptor_, Acceptor::Listen(address));
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    SetLimits(&builder);
    builder.RegisterCallbackGenericService(&services_);
    grpc_server_ = builder.BuildAndStart();
    if (grpc_server_ == nullptr) {
      return absl::InternalError("gRPC did not start; see its log");
    }
    acceptor_->Start([this](int fd, const std::string& peer) {
      if (connections_.Add(fd, peer)) {
        grpc::AddInsecureChannelFromFd(grpc_server_.get(), fd);
      } else {
        close(fd);
      }
    });
    address_ = acceptor_->address().ToString();
    return absl::OkStatus();
  }

  const std::string& address() const override { return address_; }

  ServerLoad Load() const override {
    const auto [running_count, queued_count] = workers_.Load();
    return {running_count, queued_count, questions_.open_stream_count, questions_.open_watch_count};
  }

  void Shutdown(std::chrono::milliseconds grace) override {
    if (grpc_server_ != nullptr) {
      acceptor_->Stop();
      grpc_server_->GetHealthCheckService()->Shutdown();
      // Nothing else ends watches, which would use up the grace.
      questions_.stopping = true;
      commits_.stopping = true;
      delays_.HurryAll();
      // Waits for every call. Calls that run past the grace are cancelled and then finish.
      grpc_server_->Shutdown(std::chrono::system_clock::now() + grace);
      grpc_server_->Wait();
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
  Services services_;
  std::unique_ptr<Acceptor> acceptor_;
  std::string address_;
  std::unique_ptr<grpc::Server> grpc_server_;
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

absl::Status ShuttingDownError() {
  return MakeError(Reason::kShuttingDown,
                   "the server is stopping; call again when it is back: resume a watch from the "
                   "last read_revision, and repeat maintenance to do the rest");
}

absl::Status ServerOptions::Validate() const {
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
