// SPDX-License-Identifier: Apache-2.0
// A call from the moment gRPC names its method until its request has come, as bytes. Nothing is
// parsed before a worker takes the call, so that waiting costs no more than what was sent.
#pragma once

#include <atomic>
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

/// A method of the protocol; lives as long as the server.
struct Method {
  Method(const query::MethodInfo& method, const google::protobuf::Descriptor* request)
      : info(method), cost(request) {}

  const query::MethodInfo info;
  RequestCost cost;
};

class IncomingCall : public grpc::ServerGenericBidiReactor, public Job {
 public:
  void OnReadDone(bool ok) final;
  void OnCancel() override;
  void Run() final;
  void OnDone() override { delete this; }

 protected:
  IncomingCall(CallRuntime* runtime, const Method* method,
               grpc::GenericCallbackServerContext* context,
               query::CallContext::Clock::time_point deadline);
  ~IncomingCall() override;

  /// The last step of a constructor. The call may be refused at once.
  void Receive();
  /// The request has come; wire() is charged for.
  virtual void Queue() = 0;
  /// What a worker does with the call.
  virtual void Work() = 0;
  /// Ends the call before any of it was answered.
  void Refuse(const absl::Status& status);
  /// The same with what ForCaller gave. A long request is refused late, since those who send such
  /// requests again and again would keep the processors busy with receiving them.
  void FinishRefused(const grpc::Status& status);

  /// Charges for the parsed request, parses it, and frees its bytes.
  ///
  /// Errors: those of CallMemory; INVALID_ARGUMENT/FIELD_INVALID for bytes that are no request.
  absl::Status Parse(google::protobuf::Message* request);
  /// A message of the reply as bytes.
  ///
  /// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for one that no client would take.
  absl::Status Pack(const google::protobuf::Message& message);

  /// What Finish is to be called with; adds the reason's trailer.
  grpc::Status ForCaller(const absl::Status& status);
  /// Writes the line of a call that ended with `status`, if it gets one.
  void LogEnd(std::string_view map, const absl::Status& status, int64_t revision,
              int64_t row_count) const;
  bool WantsLog(const absl::Status& status) const;

  CallRuntime& runtime() { return *runtime_; }
  grpc::GenericCallbackServerContext* context() { return context_; }
  query::CallContext& call() { return call_; }
  CallMemory::Hold& memory() { return memory_; }
  /// Of the message that Pack made.
  const grpc::ByteBuffer& packed() const { return packed_; }

 private:
  // What the request will take when parsed, or more than `bytes_max`.
  size_t EstimateBytes(size_t bytes_max);

  CallRuntime* const runtime_;
  const Method* const method_;
  grpc::GenericCallbackServerContext* const context_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  query::CallContext call_;
  const std::shared_ptr<Connection> connection_;
  CallMemory::Hold memory_;
  // While the request comes.
  std::unique_ptr<CallGuard::Place> arrival_guard_;
  std::unique_ptr<Arrivals::Place> arrival_;
  grpc::ByteBuffer wire_;
  size_t wire_bytes_ = 0;
  grpc::ByteBuffer packed_;
  // What the call ends with when Run comes again.
  std::optional<grpc::Status> refusal_;
  std::atomic<bool> refusal_waits_{false};
};

}  // namespace dsg::server
