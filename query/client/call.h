// SPDX-License-Identifier: Apache-2.0
// One RPC from start to end: deadline, cancellation, and errors as the server made them; and the
// caller that makes all RPCs of a RemoteApi. Knows nothing of what the RPCs mean.
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/support/async_stream.h>
#include <grpcpp/support/async_unary_call.h>

#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "query/api/method_info.h"
#include "query/api/stream_cursor.h"
#include "query/client/remote_api.h"
#include "query/client/retry.h"
#include "schema/base/status.h"

namespace google::protobuf {
class Message;
}  // namespace google::protobuf

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

/// The limits of a stream of this lifetime. `idle_ns`: a watch's time between two signs of life, 0
/// for the server's default.
CallLimits LimitsOf(query::Lifetime lifetime, int64_t idle_ns);

/// The calling side of one RPC in flight.
///
/// Threads: one caller; the CallContexts may be cancelled from any thread.
class CallInFlight {
 public:
  /// The deadline is that of `call`. `server` must outlive this.
  CallInFlight(const query::CallContext& call, const ServerAddress& server,
               const CallLimits& limits = {});
  ~CallInFlight();
  CallInFlight(const CallInFlight&) = delete;
  CallInFlight& operator=(const CallInFlight&) = delete;

  grpc::ClientContext* context() { return &context_; }
  grpc::CompletionQueue* queue() { return &queue_; }

  /// The tag of the one operation that may be pending.
  void* tag() { return this; }
  /// Waits for that operation; cancels the RPC when `call` is cancelled. Returns whether it went
  /// through.
  bool Wait(const query::CallContext& call);
  /// Waits for it after the RPC was cancelled or has ended.
  bool WaitForEnd();
  /// The outcome of the RPC, once Finish has delivered `status`.
  absl::Status Outcome(const grpc::Status& status) const;

 private:
  const ServerAddress& server_;
  const CallLimits limits_;
  bool was_silent_ = false;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
};

/// Marks a message that is about to be read. gRPC reports bytes that do not parse in the same way
/// as the end of a stream, even with the status OK; but it clears a message before it parses it,
/// and does not touch it at the end.
void MarkUnread(google::protobuf::Message* reply);
/// True if gRPC has not touched the message since MarkUnread.
bool IsMarkedUnread(const google::protobuf::Message& reply);
/// INTERNAL: the server sent bytes that are no message of the type of `reply`.
absl::Status UnreadableReplyError(const query::MethodInfo& method,
                                  const google::protobuf::Message& reply);

/// A stub's PrepareAsync method of a unary RPC, and of a streamed one.
template <class Stub, class Request, class Reply>
using PrepareUnary = std::unique_ptr<grpc::ClientAsyncResponseReader<Reply>> (Stub::*)(
    grpc::ClientContext*, const Request&, grpc::CompletionQueue*);
template <class Stub, class Request, class Reply>
using PrepareStream = std::unique_ptr<grpc::ClientAsyncReader<Reply>> (Stub::*)(
    grpc::ClientContext*, const Request&, grpc::CompletionQueue*);

/// A stream of a server. The RPC begins with the first Next, and ends with the cursor.
template <class Stub, class Request, class Reply>
class RemoteCursor final : public query::StreamCursor<Reply> {
 public:
  /// `server` and `stub` must outlive this.
  RemoteCursor(const ServerAddress& server, const query::MethodInfo& method, Stub* stub,
               PrepareStream<Stub, Request, Reply> prepare, Request request,
               const CallLimits& limits)
      : server_(server),
        method_(method),
        stub_(stub),
        prepare_(prepare),
        request_(std::move(request)),
        limits_(limits) {}
  ~RemoteCursor() override {
    if (rpc_ == nullptr) return;
    flight_->context()->TryCancel();
    // The reader has enough, so the cancellation is ours and no error.
    (void)Finish();
  }

  absl::StatusOr<bool> Next(const query::CallContext& call, Reply* reply) override {
    if (rpc_ != nullptr) return ReadOn(call, reply);
    // Until a message has come the whole RPC may be made again.
    bool has_message = false;
    const auto begin = [&]() -> absl::Status {
      DSG_ASSIGN_OR_RETURN(has_message, Begin(call, reply));
      return absl::OkStatus();
    };
    DSG_RETURN_IF_ERROR(server_.repeats ? RetryRead(call, begin) : begin());
    return has_message;
  }

 private:
  absl::StatusOr<bool> Begin(const query::CallContext& call, Reply* reply) {
    flight_.emplace(call, server_, limits_);
    rpc_ = (stub_->*prepare_)(flight_->context(), request_, flight_->queue());
    rpc_->StartCall(flight_->tag());
    if (!flight_->Wait(call)) return End();
    return ReadOn(call, reply);
  }

  absl::StatusOr<bool> ReadOn(const query::CallContext& call, Reply* reply) {
    MarkUnread(reply);
    rpc_->Read(reply, flight_->tag());
    if (flight_->Wait(call)) return true;
    const bool has_ended = IsMarkedUnread(*reply);
    reply->Clear();
    if (has_ended) return End();
    flight_->context()->TryCancel();
    // The cancellation is ours.
    (void)Finish();
    return UnreadableReplyError(method_, *reply);
  }

  absl::StatusOr<bool> End() {
    DSG_RETURN_IF_ERROR(Finish());
    return false;
  }

  absl::Status Finish() {
    grpc::Status status;
    rpc_->Finish(&status, flight_->tag());
    flight_->WaitForEnd();
    rpc_ = nullptr;
    return flight_->Outcome(status);
  }

  const ServerAddress& server_;
  const query::MethodInfo method_;
  Stub* const stub_;
  const PrepareStream<Stub, Request, Reply> prepare_;
  const Request request_;
  const CallLimits limits_;
  std::optional<CallInFlight> flight_;
  // Null before the RPC and after its end.
  std::unique_ptr<grpc::ClientAsyncReader<Reply>> rpc_;
};

/// Makes the RPCs of a RemoteApi.
///
/// Threads: safe from many threads. It must outlive the cursors.
class Caller {
 public:
  explicit Caller(const ServerAddress& server) : server_(server), channel_(MakeChannel(server)) {}

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }

  template <class Stub, class Request, class Reply>
  absl::Status Ask(const query::MethodInfo& method, Stub* stub,
                   PrepareUnary<Stub, Request, Reply> prepare, const query::CallContext& call,
                   const Request& request, Reply* reply) {
    const auto once = [&] { return AskOnce(method, stub, prepare, call, request, reply); };
    // A writer that repeats a call settles its outcome first, so it is not repeated here.
    return server_.repeats && method.may_repeat ? RetryRead(call, once) : once();
  }

  template <class Stub, class Request, class Reply>
  query::CursorOr<Reply> Open(const query::MethodInfo& method, Stub* stub,
                              PrepareStream<Stub, Request, Reply> prepare,
                              const query::CallContext&, const Request& request) {
    int64_t idle_ns = 0;
    if constexpr (requires { request.idle_period_ns(); }) idle_ns = request.idle_period_ns();
    return std::make_unique<RemoteCursor<Stub, Request, Reply>>(
        server_, method, stub, prepare, request, LimitsOf(method.lifetime, idle_ns));
  }

 private:
  template <class Stub, class Request, class Reply>
  absl::Status AskOnce(const query::MethodInfo& method, Stub* stub,
                       PrepareUnary<Stub, Request, Reply> prepare, const query::CallContext& call,
                       const Request& request, Reply* reply) {
    CallInFlight flight(call, server_);
    reply->Clear();
    grpc::Status status;
    auto rpc = (stub->*prepare)(flight.context(), request, flight.queue());
    rpc->StartCall();
    rpc->Finish(reply, &status, flight.tag());
    const bool is_whole = flight.Wait(call);
    DSG_RETURN_IF_ERROR(flight.Outcome(status));
    // gRPC calls it OK when the bytes came and are no message.
    return is_whole ? absl::OkStatus() : UnreadableReplyError(method, *reply);
  }

  const ServerAddress server_;
  const std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace dsg::client
