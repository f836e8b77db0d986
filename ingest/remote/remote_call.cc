// SPDX-License-Identifier: Apache-2.0
#include "ingest/remote/remote_call.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::ingest {
namespace {

using Clock = WaitNotes::Clock;
using std::chrono::milliseconds;

// Longer than any commit of 4 MiB takes on a slow disk; a slow link gets more with each attempt.
constexpr std::chrono::seconds kAttemptTimeout(60);
constexpr std::chrono::seconds kAttemptTimeoutMax(600);
constexpr milliseconds kFirstPause(50);
constexpr milliseconds kLongestPause(5000);
// Routers forget a connection after some minutes, some after 30 s. The server refuses pings that
// come more often than every 10 s.
constexpr int kKeepaliveMs = 20'000;
constexpr int kKeepaliveTimeoutMs = 10'000;
// Connecting takes two round trips; the first packet of it may be lost twice.
constexpr int kConnectTimeoutMs = 5'000;
// What gRPC makes of a broken link is not always UNAVAILABLE; a bug of the server looks alike.
constexpr int kOddAnswersMax = 5;

enum class Outcome { kAnswered, kUnanswered, kOdd };

Outcome OutcomeOf(const absl::Status& status) {
  switch (ReasonOf(status)) {
    case Reason::kUnspecified:
      break;
    case Reason::kShuttingDown:
    case Reason::kCommitOutcomeUnknown:
    case Reason::kOverloaded:
      return Outcome::kUnanswered;
    default:
      return Outcome::kAnswered;
  }
  switch (status.code()) {
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDeadlineExceeded:
    // We cancel nothing: a server that ends at once does.
    case absl::StatusCode::kCancelled:
      return Outcome::kUnanswered;
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnknown:
      return Outcome::kOdd;
    default:
      return Outcome::kAnswered;
  }
}

std::string Why(const absl::Status& status) {
  if (absl::IsDeadlineExceeded(status)) return "no answer to a call";
  return std::string(status.message());
}

// Robots that are started at the same moment must not draw the same pauses.
uint64_t SeedOfThisProcess() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<uint64_t>(now.count()) ^ (static_cast<uint64_t>(getpid()) << 40);
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
  // In spite of its name the time that one attempt to connect may take.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectTimeoutMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetCompressionAlgorithm(GRPC_COMPRESS_NONE);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

absl::Status ToStatus(const grpc::ClientContext& context, const grpc::Status& status) {
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto trailer = trailers.find(kErrorTrailer);
  std::string_view detail;
  if (trailer != trailers.end()) detail = {trailer->second.data(), trailer->second.size()};
  return DecodeStatus(status.error_code(), status.error_message(), detail);
}

ServerCaller::ServerCaller(std::string address, TimeNs retry_ns_max, TellWait tell)
    : address_(std::move(address)),
      retry_ns_max_(retry_ns_max),
      random_(SeedOfThisProcess(), 0),
      notes_(address_, std::move(tell)) {}

absl::Status ServerCaller::Call(const std::function<grpc::Status(grpc::ClientContext*)>& attempt) {
  const Clock::time_point give_up = Clock::now() + std::chrono::nanoseconds(retry_ns_max_);
  notes_.CallBegins(give_up);
  const absl::Status status = Repeat(attempt, give_up);
  notes_.CallEnds(status.ok());
  return status;
}

absl::Status ServerCaller::Repeat(const std::function<grpc::Status(grpc::ClientContext*)>& attempt,
                                  Clock::time_point give_up) {
  milliseconds pause = kFirstPause;
  std::chrono::seconds timeout = kAttemptTimeout;
  int odd_count = 0;
  while (true) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + timeout);
    const grpc::Status answer = attempt(&context);
    const absl::Status status = ToStatus(context, answer);
    const Outcome outcome = status.ok() ? Outcome::kAnswered : OutcomeOf(status);
    if (outcome == Outcome::kAnswered) return status;
    if (outcome == Outcome::kOdd && ++odd_count >= kOddAnswersMax) return status;
    if (absl::IsDeadlineExceeded(status)) timeout = std::min(2 * timeout, kAttemptTimeoutMax);
    const milliseconds drawn(
        static_cast<int64_t>(static_cast<double>(pause.count()) * random_.Uniform(0.5, 1.0)));
    if (Clock::now() + drawn > give_up) {
      return Annotate(
          status,
          absl::StrCat("server ", address_, " did not answer for ", retry_ns_max_ / kNsPerSecond,
                       " s; is dsg-server running there? What is committed is safe: "
                       "run the same again, and it goes on from there"));
    }
    notes_.AttemptFailed(Why(status));
    std::this_thread::sleep_for(drawn);
    pause = std::min(2 * pause, kLongestPause);
  }
}

}  // namespace dsg::ingest
