// SPDX-License-Identifier: Apache-2.0
#include "query/client/call.h"

#include <google/protobuf/message.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::client {
namespace {

using query::CallContext;

// How soon a cancellation is noticed.
constexpr std::chrono::milliseconds kPollPeriod{20};

// Signs of life of a watch; see map_service.proto.
constexpr int64_t kWatchIdleDefaultNs = 5'000'000'000;
constexpr int64_t kWatchIdleMaxNs = 86'400'000'000'000;

// The largest number of a field; the protocol has none so large.
constexpr int kUnreadMark = 536'870'911;

std::chrono::system_clock::time_point WallDeadline(const CallContext& call,
                                                   std::chrono::seconds timeout) {
  const auto now = std::chrono::system_clock::now();
  if (call.deadline() == CallContext::Clock::time_point::max()) {
    return timeout.count() == 0 ? std::chrono::system_clock::time_point::max() : now + timeout;
  }
  return now + std::chrono::duration_cast<std::chrono::system_clock::duration>(
                   call.deadline() - CallContext::Clock::now());
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

CallLimits LimitsOf(query::Lifetime lifetime, int64_t idle_ns) {
  constexpr std::chrono::seconds kForEver(0);
  switch (lifetime) {
    case query::Lifetime::kAnswer:
      return {};
    case query::Lifetime::kWatch: {
      // Lasts until its reader has enough, or nothing is heard for three signs of life.
      const int64_t period_ns = idle_ns > 0 ? idle_ns : kWatchIdleDefaultNs;
      return {kForEver, std::chrono::seconds(10) +
                            3 * std::chrono::nanoseconds(std::min(period_ns, kWatchIdleMaxNs))};
    }
    case query::Lifetime::kWork:
      // Takes as long as it takes; the keepalive of the channel finds a server that is gone.
      return {kForEver, std::chrono::nanoseconds(0)};
  }
  return {};
}

void MarkUnread(google::protobuf::Message* reply) {
  reply->GetReflection()->MutableUnknownFields(reply)->AddVarint(kUnreadMark, 0);
}

bool IsMarkedUnread(const google::protobuf::Message& reply) {
  const auto& fields = reply.GetReflection()->GetUnknownFields(reply);
  return fields.field_count() == 1 && fields.field(0).number() == kUnreadMark;
}

absl::Status UnreadableReplyError(const query::MethodInfo& method,
                                  const google::protobuf::Message& reply) {
  return absl::InternalError(absl::StrCat(
      "what the server sent in reply to ", std::string(method.name), " is no ", reply.GetTypeName(),
      "; is the server of another version, or its map damaged? dsg verify looks at the map"));
}

CallInFlight::CallInFlight(const CallContext& call, const ServerAddress& server,
                           const CallLimits& limits)
    : server_(server), limits_(limits) {
  context_.set_deadline(WallDeadline(call, limits.timeout));
  if (const std::string& token = server.credentials.token; !token.empty()) {
    context_.AddMetadata("authorization", absl::StrCat("Bearer ", token));
  }
}

CallInFlight::~CallInFlight() {
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

bool CallInFlight::Wait(const CallContext& call) {
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
        if (was_silent_ || call.cancelled()) context_.TryCancel();
        break;
    }
  }
}

bool CallInFlight::WaitForEnd() {
  void* event_tag = nullptr;
  bool ok = false;
  return queue_.Next(&event_tag, &ok) && ok;
}

absl::Status CallInFlight::Outcome(const grpc::Status& status) const {
  if (status.ok()) return absl::OkStatus();
  if (was_silent_) {
    return absl::UnavailableError(absl::StrCat("dsg-server at ", server_.address,
                                               " gave no sign of life for too long; call again "
                                               "from where the stream ended"));
  }
  const std::string_view detail = Trailer(context_);
  absl::Status decoded = DecodeStatus(status.error_code(), status.error_message(), detail);
  // Errors with a reason, known here or not, were made by the server; the others by the transport,
  // which names neither the address nor a way out.
  if (!detail.empty() || !server_.repeats) return decoded;
  switch (decoded.code()) {
    case absl::StatusCode::kUnavailable:
      return NoServer(server_.address, status.error_message());
    case absl::StatusCode::kDeadlineExceeded:
      return absl::DeadlineExceededError(
          absl::StrCat("dsg-server at ", server_.address,
                       " did not answer in time; ask for less or allow more time"));
    case absl::StatusCode::kCancelled:
      return absl::CancelledError(absl::StrCat("call to ", server_.address, " cancelled"));
    default:
      return decoded;
  }
}

}  // namespace dsg::client
