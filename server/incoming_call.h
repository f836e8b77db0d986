// SPDX-License-Identifier: Apache-2.0
// A call from the moment gRPC names its method until its request has arrived as bytes. The request
// is parsed only when a worker takes the call, so that a waiting call costs no more memory than its
// bytes.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "absl/status/status.h"
#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/grpcpp.h"
#include "query/api/method_info.h"
#include "server/call_runtime.h"
#include "server/request_cost.h"

namespace google::protobuf {
class Message;
}  // namespace google::protobuf

namespace dsg::server {

/// A method of the protocol. Lives as long as the server.
struct Method {
  Method(const query::MethodInfo& method, const google::protobuf::Descriptor* request)
      : info(method), cost(request) {}

  const query::MethodInfo info;
  RequestCost cost;
};

class IncomingCall : public grpc::ServerGenericBidiReactor, public Job {
 public:
  void OnReadDone(bool ok) final;
  void OnCancel() final;
  void Run() final;
  void OnDone() override { delete this; }

 protected:
  IncomingCall(CallRuntime* runtime, const Method* method,
               grpc::GenericCallbackServerContext* context,
               query::CallContext::Clock::time_point deadline);
  ~IncomingCall() override;

  /// Starts to receive the request. To be called last in a constructor; may refuse the call at
  /// once.
  void Receive();
  /// Called when the request has arrived and its bytes are charged.
  virtual void Queue() = 0;
  /// What a worker does with the call.
  virtual void Work() = 0;
  /// Ends the call before any of it was answered.
  void Refuse(const absl::Status& status);
  /// The same with what ForCaller gave. A long request is refused late, since those who send such
  /// requests again and again would keep the processors busy with receiving them.
  void FinishRefused(const grpc::Status& status);
  /// Frees what only an answer needs: a refusal that waits holds nothing.
  virtual void DropWork() = 0;

  /// Charges for the parsed request, parses it, and frees its bytes.
  ///
  /// Errors: those of CallMemory; INVALID_ARGUMENT/FIELD_INVALID if the bytes do not parse.
  absl::Status Parse(google::protobuf::Message* request);
  /// Serializes a message of the reply into packed().
  ///
  /// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED above kMessageBytesMaxOnWire.
  absl::Status Pack(const google::protobuf::Message& message);

  /// The argument for Finish. Adds the trailer with the reason.
  grpc::Status ForCaller(const absl::Status& status);
  /// Logs a call that ended with `status`, if CallLog wants it.
  void LogEnd(std::string_view map, const absl::Status& status, int64_t revision,
              int64_t row_count) const;
  bool WantsLog(const absl::Status& status) const;

  CallRuntime& runtime() { return *runtime_; }
  grpc::GenericCallbackServerContext* context() { return context_; }
  query::CallContext& call() { return call_; }
  CallMemory::Hold& memory() { return memory_; }
  /// The bytes that Pack made.
  const grpc::ByteBuffer& packed() const { return packed_; }

 private:
  // Memory of the parsed request in bytes; counting stops above `bytes_max`.
  size_t EstimateBytes(size_t bytes_max);

  CallRuntime* const runtime_;
  const Method* const method_;
  grpc::GenericCallbackServerContext* const context_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  query::CallContext call_;
  const std::shared_ptr<Connection> connection_;
  CallMemory::Hold memory_;
  // Set while the request is being received.
  std::unique_ptr<CallGuard::Place> arrival_guard_;
  std::unique_ptr<Arrivals::Place> arrival_;
  grpc::ByteBuffer wire_;
  size_t wire_bytes_ = 0;
  grpc::ByteBuffer packed_;
  // What the call ends with when Run comes again.
  std::optional<grpc::Status> refusal_;
};

}  // namespace dsg::server
