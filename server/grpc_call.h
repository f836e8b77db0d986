// SPDX-License-Identifier: Apache-2.0
// A call that came over gRPC, from the moment gRPC names its method until it is done with it.
#pragma once

#include <memory>

#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/grpcpp.h"
#include "server/served_call.h"

namespace dsg::server {

/// Deletes itself when gRPC is done with it.
class GrpcCall final : public grpc::ServerGenericBidiReactor, public CallWire {
 public:
  /// Starts to receive the request; may refuse the call at once.
  GrpcCall(const Method* method, grpc::CallbackServerContext* context);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override { call_->OnSent(ok); }
  void OnCancel() override { call_->Cancel(); }
  void OnDone() override { delete this; }

  size_t request_bytes() const override { return request_.Length(); }
  size_t decode_bytes() const override { return 0; }
  absl::Status Decode(const google::protobuf::Descriptor& type) override;
  std::unique_ptr<google::protobuf::io::ZeroCopyInputStream> OpenRequest() override;
  absl::Status Pack(const google::protobuf::Message& message) override;
  size_t packed_bytes() const override { return packed_.Length(); }
  void Drop() override;
  void Send() override { StartWrite(&packed_); }
  void SendLast(const absl::Status& status) override;
  void Finish(const absl::Status& status) override;
  EndCall ender() override;
  bool ends_stalled() const override;

 private:
  // Adds the trailer with our own detail; the details that all clients know come with the status.
  grpc::Status LastWords(const absl::Status& status);

  CallRuntime* const runtime_;
  grpc::CallbackServerContext* const context_;
  const std::shared_ptr<Connection> connection_;
  const std::unique_ptr<ServedCall> call_;
  // Set while the request is being received.
  std::unique_ptr<CallGuard::Place> arrival_guard_;
  std::unique_ptr<Arrivals::Place> arrival_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer packed_;
};

}  // namespace dsg::server
