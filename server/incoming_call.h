// SPDX-License-Identifier: Apache-2.0
// A call from the moment gRPC names its method until its request has arrived as bytes. The request
// is parsed only when a worker takes the call, so that a waiting call costs no more memory than its
// bytes.
#pragma once

#include <memory>
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
  void OnCancel() override { call_.Cancel(); }
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
  /// Ends the call before any of it was answered.
  void Refuse(const absl::Status& status);

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
  grpc::ByteBuffer packed_;
};

}  // namespace dsg::server
