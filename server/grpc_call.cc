// SPDX-License-Identifier: Apache-2.0
#include "server/grpc_call.h"

#include <google/protobuf/message.h>

#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "google/rpc/status.pb.h"
#include "grpc/grpc.h"
#include "grpcpp/impl/codegen/proto_utils.h"
#include "grpcpp/support/proto_buffer_reader.h"
#include "grpcpp/support/proto_buffer_writer.h"
#include "schema/codec/status_decode.h"
#include "server/call_deadline.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

// Two fields are none that anybody knows.
std::optional<std::string_view> AuthorizationOf(const grpc::CallbackServerContext& context) {
  const auto [first, end] = context.client_metadata().equal_range("authorization");
  if (first == end) return std::nullopt;
  if (std::next(first) != end) return "";
  return std::string_view(first->second.data(), first->second.size());
}

}  // namespace

GrpcCall::GrpcCall(const Method* method, grpc::CallbackServerContext* context)
    : runtime_(method->runtime),
      context_(context),
      connection_(runtime_->connections->Find(context->peer())),
      call_(method->make(method, this, connection_, context->deadline())) {
  if (!call_->Admit(runtime_->access->Identify(connection_->identity, AuthorizationOf(*context)))) {
    return;
  }
  // gRPC ends only calls whose caller set a deadline, and no handler runs meanwhile.
  if (!ends_stalled()) {
    arrival_guard_ = runtime_->guard->Guard(ender(), BoundDeadline(context->deadline()));
  }
  arrival_ = runtime_->arrivals->Enter(ender(), connection_.get());
  StartRead(&request_);
}

void GrpcCall::OnReadDone(bool ok) {
  arrival_guard_ = nullptr;
  arrival_ = nullptr;
  if (ok) {
    call_->Begin();
  } else {
    call_->GiveUp();
  }
}

absl::Status GrpcCall::Decode(const google::protobuf::Descriptor&) { return absl::OkStatus(); }

std::unique_ptr<google::protobuf::io::ZeroCopyInputStream> GrpcCall::OpenRequest() {
  return std::make_unique<grpc::ProtoBufferReader>(&request_);
}

absl::Status GrpcCall::Pack(const google::protobuf::Message& message) {
  bool own = false;
  packed_.Clear();
  const grpc::Status packed =
      grpc::GenericSerialize<grpc::ProtoBufferWriter, google::protobuf::Message>(message, &packed_,
                                                                                 &own);
  if (!packed.ok()) return absl::InternalError(packed.error_message());
  absl::Status checked = CheckMessageBytes(packed_.Length());
  if (!checked.ok()) packed_.Clear();
  return checked;
}

void GrpcCall::Drop() {
  request_.Clear();
  packed_.Clear();
}

void GrpcCall::SendLast(const absl::Status& status) {
  StartWriteAndFinish(&packed_, grpc::WriteOptions(), LastWords(status));
}

void GrpcCall::Finish(const absl::Status& status) {
  grpc::ServerGenericBidiReactor::Finish(LastWords(status));
}

EndCall GrpcCall::ender() {
  grpc_call* const call = context_->c_call();
  grpc_call_ref(call);
  return [kept = std::shared_ptr<grpc_call>(call, grpc_call_unref)](const absl::Status& status) {
    grpc_call_cancel_with_status(kept.get(), static_cast<grpc_status_code>(status.code()),
                                 std::string(status.message()).c_str(), nullptr);
  };
}

bool GrpcCall::ends_stalled() const { return !OutlastsBound(context_->deadline()); }

grpc::Status GrpcCall::LastWords(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const google::rpc::Status error = ErrorStatus(status);
  std::string detail = OwnDetail(error);
  if (!detail.empty()) context_->AddTrailingMetadata(kErrorTrailer, std::move(detail));
  return ToGrpc(error);
}

}  // namespace dsg::server
