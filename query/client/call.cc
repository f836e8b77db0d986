// SPDX-License-Identifier: Apache-2.0
#include "query/client/call.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <thread>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::client {
namespace {

using query::CallContext;

// How soon a cancellation is noticed.
constexpr std::chrono::milliseconds kPollPeriod{20};

constexpr std::array<std::chrono::milliseconds, 3> kBackoffs{
    std::chrono::milliseconds{100}, std::chrono::milliseconds{300}, std::chrono::milliseconds{900}};

std::chrono::system_clock::time_point WallDeadline(const CallContext& call,
                                                   std::chrono::seconds timeout) {
  const auto now = std::chrono::system_clock::now();
  if (call.deadline() == CallContext::Clock::time_point::max()) {
    return timeout.count() == 0 ? std::chrono::system_clock::time_point::max() : now + timeout;
  }
  return now + std::chrono::duration_cast<std::chrono::system_clock::duration>(
                   call.deadline() - CallContext::Clock::now());
}

// False if the call must not be tried again.
bool Pause(const CallContext& call, std::chrono::milliseconds length) {
  const auto end = CallContext::Clock::now() + length;
  if (end >= call.deadline()) return false;
  for (auto now = CallContext::Clock::now(); now < end; now = CallContext::Clock::now()) {
    if (call.cancelled()) return false;
    std::this_thread::sleep_for(std::min<CallContext::Clock::duration>(kPollPeriod, end - now));
  }
  return !call.cancelled();
}

std::string_view Trailer(const grpc::ClientContext& context) {
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto found = trailers.find(kErrorTrailer);
  if (found == trailers.end()) return {};
  return {found->second.data(), found->second.size()};
}

absl::Status NoServer(const std::string& address, const std::string& why) {
  return absl::UnavailableError(absl::StrCat("no dsg-server answers at ", address, " (", why,
                                             "); start one with: dsg-server --store DIR --listen ",
                                             address));
}

}  // namespace

CallInFlight::CallInFlight(const CallContext& call, const std::string& address,
                           const CallLimits& limits)
    : call_(call), address_(address), limits_(limits) {
  context_.set_deadline(WallDeadline(call, limits.timeout));
}

CallInFlight::~CallInFlight() {
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

bool CallInFlight::Wait() {
  void* event_tag = nullptr;
  bool ok = false;
  const auto begin = CallContext::Clock::now();
  while (true) {
    const auto poll_end = std::chrono::system_clock::now() + kPollPeriod;
    switch (queue_.AsyncNext(&event_tag, &ok, poll_end)) {
      case grpc::CompletionQueue::GOT_EVENT:
        return ok;
      case grpc::CompletionQueue::SHUTDOWN:
        return false;
      case grpc::CompletionQueue::TIMEOUT:
        was_silent_ = was_silent_ || (limits_.silence_max.count() > 0 &&
                                      CallContext::Clock::now() - begin > limits_.silence_max);
        if (was_silent_ || call_.cancelled()) context_.TryCancel();
        break;
    }
  }
}

absl::Status CallInFlight::Outcome(const grpc::Status& status) const {
  if (status.ok()) return absl::OkStatus();
  if (was_silent_) {
    return absl::UnavailableError(absl::StrCat("dsg-server at ", address_,
                                               " gave no sign of life for too long; call again "
                                               "from where the stream ended"));
  }
  const std::string_view detail = Trailer(context_);
  absl::Status decoded = DecodeStatus(status.error_code(), status.error_message(), detail);
  // Errors with a reason, known here or not, were made by the server; the others by the transport,
  // which names neither the address nor a way out.
  if (!detail.empty()) return decoded;
  switch (decoded.code()) {
    case absl::StatusCode::kUnavailable:
      return NoServer(address_, status.error_message());
    case absl::StatusCode::kDeadlineExceeded:
      return absl::DeadlineExceededError(absl::StrCat(
          "dsg-server at ", address_, " did not answer in time; ask for less or allow more time"));
    case absl::StatusCode::kCancelled:
      return absl::CancelledError(absl::StrCat("call to ", address_, " cancelled"));
    default:
      return decoded;
  }
}

absl::Status RetryRead(const CallContext& call, const std::function<absl::Status()>& attempt) {
  absl::Status status = attempt();
  for (const auto backoff : kBackoffs) {
    if (!absl::IsUnavailable(status) || !Pause(call, backoff)) break;
    status = attempt();
  }
  return status;
}

}  // namespace dsg::client
