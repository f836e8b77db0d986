// SPDX-License-Identifier: Apache-2.0
#include "ingest/remote/remote_call.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "dsg/v1/errors.pb.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kErrorTrailer[] = "dsg-error-bin";
// Longer than any commit of 4 MiB takes, even on a slow disk.
constexpr std::chrono::seconds kAttemptTimeout(60);
constexpr std::chrono::milliseconds kFirstPause(50);
constexpr std::chrono::milliseconds kLongestPause(2000);

bool IsWorthRepeating(const absl::Status& status) {
  switch (ReasonOf(status)) {
    case Reason::kUnspecified:
      return status.code() == absl::StatusCode::kUnavailable;
    case Reason::kShuttingDown:
    case Reason::kCommitOutcomeUnknown:
    case Reason::kOverloaded:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::shared_ptr<grpc::Channel> OpenChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxSendMessageSize(kSendBytesMax);
  arguments.SetMaxReceiveMessageSize(kReceiveBytesMax);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_SERVICE_CONFIG_DISABLE_RESOLUTION, 1);
  // gRPC's own second of patience would swallow most of our repetitions.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetCompressionAlgorithm(GRPC_COMPRESS_NONE);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

absl::Status ToStatus(const grpc::ClientContext& context, const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto trailer = trailers.find(kErrorTrailer);
  v1::ErrorDetail detail;
  if (trailer != trailers.end() &&
      detail.ParseFromArray(trailer->second.data(), static_cast<int>(trailer->second.size())) &&
      detail.reason() != v1::REASON_UNSPECIFIED) {
    const auto reason = static_cast<Reason>(static_cast<int>(detail.reason()));
    return MakeError(reason, status.error_message(),
                     {detail.metadata().begin(), detail.metadata().end()});
  }
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

absl::Status CallWithRetry(const std::string& address, TimeNs retry_ns_max,
                           const std::function<grpc::Status(grpc::ClientContext*)>& attempt) {
  const Clock::time_point give_up = Clock::now() + std::chrono::nanoseconds(retry_ns_max);
  std::chrono::milliseconds pause = kFirstPause;
  while (true) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kAttemptTimeout);
    const grpc::Status answer = attempt(&context);
    const absl::Status status = ToStatus(context, answer);
    if (status.ok() || !IsWorthRepeating(status)) return status;
    if (Clock::now() + pause > give_up) {
      return Annotate(
          status, absl::StrCat("server ", address, " did not answer for ",
                               retry_ns_max / kNsPerSecond, " s; is dsg-server running there?"));
    }
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, kLongestPause);
  }
}

}  // namespace dsg::ingest
