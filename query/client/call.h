// SPDX-License-Identifier: Apache-2.0
// One RPC from start to end: deadline, cancellation, retries, and errors as the server made them.
// Knows nothing of what the RPCs mean.
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/support/async_stream.h>
#include <grpcpp/support/async_unary_call.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "query/engine/call_context.h"

namespace dsg::client {

/// What a call without a deadline is given.
inline constexpr std::chrono::seconds kDefaultTimeout{10};

/// How long a call may take if its CallContext has no deadline, and be silent.
struct CallLimits {
  /// 0 = for ever.
  std::chrono::seconds timeout = kDefaultTimeout;
  /// A stream without a message for so long is given up; 0 = wait.
  std::chrono::nanoseconds silence_max{0};
};

/// The calling side of one RPC in flight.
///
/// Threads: one caller; the CallContext may be cancelled from any thread.
class CallInFlight {
 public:
  /// `call` and `address` must outlive this.
  CallInFlight(const query::CallContext& call, const std::string& address,
               const CallLimits& limits = {});
  ~CallInFlight();
  CallInFlight(const CallInFlight&) = delete;
  CallInFlight& operator=(const CallInFlight&) = delete;

  grpc::ClientContext* context() { return &context_; }
  grpc::CompletionQueue* queue() { return &queue_; }

  /// The tag of the one operation that may be pending.
  void* tag() { return this; }
  /// Waits for that operation, passing a cancellation on. Returns whether it went through.
  bool Wait();
  /// The outcome of the RPC, once Finish has delivered `status`.
  absl::Status Outcome(const grpc::Status& status) const;

 private:
  const query::CallContext& call_;
  const std::string& address_;
  const CallLimits limits_;
  bool was_silent_ = false;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
};

/// Runs `attempt` again after UNAVAILABLE: at most 3 times more, within 2 s, never past the
/// deadline or a cancellation. For calls that change nothing.
absl::Status RetryRead(const query::CallContext& call,
                       const std::function<absl::Status()>& attempt);

/// One unary RPC. `prepare` is the stub's PrepareAsync method.
template <class Stub, class Request, class Reply>
absl::Status CallOnce(const query::CallContext& call, const std::string& address, Stub* stub,
                      std::unique_ptr<grpc::ClientAsyncResponseReader<Reply>> (Stub::*prepare)(
                          grpc::ClientContext*, const Request&, grpc::CompletionQueue*),
                      const Request& request, Reply* reply) {
  CallInFlight flight(call, address);
  reply->Clear();
  grpc::Status status;
  auto rpc = (stub->*prepare)(flight.context(), request, flight.queue());
  rpc->StartCall();
  rpc->Finish(reply, &status, flight.tag());
  flight.Wait();
  return flight.Outcome(status);
}

}  // namespace dsg::client
