// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <sys/stat.h>

#include <algorithm>
#include <thread>

#include "absl/strings/str_cat.h"
#include "grpcpp/ext/health_check_service_server_builder_option.h"
#include "grpcpp/grpcpp.h"
#include "schema/base/status.h"
#include "server/call_runtime.h"
#include "server/listen_address.h"
#include "server/services.h"
#include "server/unix_socket.h"

namespace dsg::server {
namespace {

constexpr int kMessageBytesMaxOnWire = 4 << 20;
// Commits wait for the disk and for each other; they must not take the workers of questions.
constexpr int kCommitWorkerCount = 2;
constexpr int kCommitsInFlightMax = 32;

int WorkerCount(int asked) {
  if (asked > 0) return asked;
  return std::max(4, 2 * static_cast<int>(std::thread::hardware_concurrency()));
}

// What a peer may do to us, bounded. gRPC 1.51 trusts its peers too much by default.
void SetLimits(grpc::ServerBuilder* builder) {
  // Otherwise a second server shares the port, and calls go to either.
  builder->AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder->SetMaxReceiveMessageSize(kMessageBytesMaxOnWire);
  builder->SetMaxSendMessageSize(kMessageBytesMaxOnWire);
  // The message limit is checked after inflating: 1 MiB of gzip became 1 GiB of memory.
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder->SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 64);
  builder->AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8 << 10);
  builder->AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 5'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 3);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, 600'000);
}

// Makes files of this process for its user only while it lives. The socket is made inside gRPC.
class PrivateFiles {
 public:
  PrivateFiles() : before_(umask(0177)) {}
  ~PrivateFiles() { umask(before_); }
  PrivateFiles(const PrivateFiles&) = delete;
  PrivateFiles& operator=(const PrivateFiles&) = delete;

 private:
  mode_t before_;
};

absl::Status CheckRange(const std::string& option, int value, int min, int max) {
  if (value >= min && value <= max) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(option, " is ", value, "; give ", min, " to ", max),
                   {{"field", option}, {"value", absl::StrCat(value)}});
}

class RunningServer final : public Server {
 public:
  RunningServer(std::unique_ptr<query::ServiceCore> core, const ServerOptions& options)
      : core_(std::move(core)),
        workers_(WorkerCount(options.worker_count), options.in_flight_max),
        commit_workers_(kCommitWorkerCount, std::min(options.in_flight_max, kCommitsInFlightMax)),
        delays_(&workers_),
        guard_(options.reader_stall_max) {
    Prepare(options, &workers_, &questions_);
    Prepare(options, &commit_workers_, &commits_);
    services_.push_back(MakeQueryService(&questions_));
    services_.push_back(MakeMapService(&questions_));
    services_.push_back(MakeIngestService(&commits_));
    // Beside the commits, as it writes too and may wait for them.
    services_.push_back(MakeMaintenanceService(&commits_));
  }

  ~RunningServer() override { Shutdown(std::chrono::seconds(1)); }

  absl::Status Listen(const ServerOptions& options) {
    DSG_ASSIGN_OR_RETURN(ListenAddress address,
                         ParseListenAddress(options.listen, options.allow_remote));
    if (address.is_unix()) {
      DSG_ASSIGN_OR_RETURN(claim_, UnixSocketClaim::Take(address.socket_path));
    }
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    SetLimits(&builder);
    for (const auto& service : services_) builder.RegisterService(service.get());
    int port = 0;
    builder.AddListeningPort(address.ToString(), grpc::InsecureServerCredentials(), &port);
    {
      const PrivateFiles private_files;
      grpc_server_ = builder.BuildAndStart();
    }
    if (grpc_server_ == nullptr || port == 0) {
      grpc_server_ = nullptr;
      const std::string why = address.is_unix() ? "" : ExplainBindFailure(address);
      return absl::UnavailableError(
          absl::StrCat("cannot listen on ", address.ToString(), ": ",
                       why.empty() ? "the system refused it" : why,
                       "; stop what listens there, or give another address"));
    }
    if (!address.is_unix()) address.port = port;
    address_ = address.ToString();
    return absl::OkStatus();
  }

  const std::string& address() const override { return address_; }

  ServerLoad Load() const override {
    const auto [running_count, queued_count] = workers_.Load();
    return {running_count, queued_count, questions_.open_stream_count, questions_.open_watch_count};
  }

  void Shutdown(std::chrono::milliseconds grace) override {
    if (grpc_server_ != nullptr) {
      grpc_server_->GetHealthCheckService()->Shutdown();
      // Watches would use up the grace, since nothing else ends them.
      questions_.stopping = true;
      commits_.stopping = true;
      delays_.HurryAll();
      // Waits for every call: those that run past the grace are cancelled, see it, and finish.
      grpc_server_->Shutdown(std::chrono::system_clock::now() + grace);
      grpc_server_->Wait();
      // It may still hold a call that it has just ended.
      guard_.Stop();
      grpc_server_ = nullptr;
    }
    guard_.Stop();
    delays_.Stop();
    workers_.Stop();
    commit_workers_.Stop();
    claim_ = nullptr;
  }

 private:
  void Prepare(const ServerOptions& options, WorkerPool* workers, CallRuntime* runtime) {
    runtime->core = core_.get();
    runtime->workers = workers;
    runtime->guard = &guard_;
    runtime->log = CallLog(options.log_all_calls);
    runtime->open_stream_max = options.open_stream_max;
    runtime->delays = &delays_;
    runtime->open_watch_max = options.open_watch_max;
  }

  // In the order of need: what stands lower is destroyed first.
  std::unique_ptr<query::ServiceCore> core_;
  std::unique_ptr<UnixSocketClaim> claim_;
  WorkerPool workers_;
  WorkerPool commit_workers_;
  DelayQueue delays_;
  CallGuard guard_;
  CallRuntime questions_;
  CallRuntime commits_;
  std::vector<std::unique_ptr<grpc::Service>> services_;
  std::string address_;
  std::unique_ptr<grpc::Server> grpc_server_;
};

}  // namespace

absl::Status OverloadedError() {
  return MakeError(Reason::kOverloaded,
                   "the server has as many calls as it takes at a time; retry after a pause, and "
                   "use the batch calls instead of many small ones");
}

absl::Status TooManyWatchesError(int watch_max) {
  return MakeError(Reason::kOverloaded,
                   absl::StrCat("the server keeps ", watch_max,
                                " watches at a time, and all are taken; end one, ask with "
                                "ListRevisions instead, or start the server with --max-watches"),
                   {{"watches", absl::StrCat(watch_max)}});
}

absl::Status ShuttingDownError() {
  return MakeError(Reason::kShuttingDown,
                   "the server is stopping; call again when it is back: a watch goes on from "
                   "the last read_revision, and maintenance does what is left");
}

absl::Status ServerOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckRange("workers", worker_count, 0, 256));
  DSG_RETURN_IF_ERROR(CheckRange("max-in-flight", in_flight_max, 1, 65536));
  DSG_RETURN_IF_ERROR(CheckRange("max-streams", open_stream_max, 1, 65536));
  DSG_RETURN_IF_ERROR(CheckRange("max-watches", open_watch_max, 0, 65536));
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
