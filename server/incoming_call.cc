// SPDX-License-Identifier: Apache-2.0
#include "server/incoming_call.h"

#include <google/protobuf/message.h>

#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "grpcpp/impl/codegen/proto_utils.h"
#include "grpcpp/support/proto_buffer_reader.h"
#include "grpcpp/support/proto_buffer_writer.h"
#include "schema/base/status.h"
#include "server/call_deadline.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

using google::protobuf::Message;

// Requests that are longer are counted, and refused, one after another.
constexpr size_t kLongBytes = size_t{64} << 10;

absl::Status UnreadableError(const Message& request, size_t bytes) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the ", bytes, " bytes of the request are no ",
                                request.GetDescriptor()->full_name(),
                                "; make them with the types in proto/dsg/v1 (text is UTF-8, and "
                                "messages are nested at most 100 deep)"),
                   {{"field", ""}});
}

absl::Status TooLongError(size_t bytes) {
  return MakeError(
      Reason::kLimitExceeded,
      absl::StrCat("the reply has ", bytes, " bytes, and a message at most ",
                   kMessageBytesMaxOnWire, "; ask for less at a time"),
      {{"bytes", absl::StrCat(bytes)}, {"bytes_max", absl::StrCat(kMessageBytesMaxOnWire)}});
}

}  // namespace

IncomingCall::IncomingCall(CallRuntime* runtime, const Method* method,
                           grpc::GenericCallbackServerContext* context,
                           query::CallContext::Clock::time_point deadline)
    : runtime_(runtime),
      method_(method),
      context_(context),
      call_(deadline),
      connection_(runtime->connections->Find(context->peer())),
      memory_(runtime->memory, connection_) {}

IncomingCall::~IncomingCall() { runtime_->connections->EndCall(connection_.get()); }

void IncomingCall::Receive() {
  if (!runtime_->connections->BeginCall(connection_.get())) {
    Refuse(OverloadedError("the connection has more calls than it may have, and was closed"));
    return;
  }
  // gRPC ends only calls whose caller set a deadline, and no handler runs meanwhile.
  if (OutlastsBound(context_->deadline())) {
    arrival_guard_ =
        runtime_->guard->Guard(context_->c_call(), BoundDeadline(context_->deadline()));
  }
  arrival_ = runtime_->arrivals->Enter(context_->c_call(), connection_.get());
  StartRead(&wire_);
}

void IncomingCall::OnReadDone(bool ok) {
  arrival_guard_ = nullptr;
  arrival_ = nullptr;
  if (!ok) {
    // Not logged: a flood of resets would fill the log.
    runtime_->connections->CountReset(connection_.get());
    Finish(ForCaller(MakeError(Reason::kFieldInvalid,
                               "the call ended before its request had come whole; send one message",
                               {{"field", ""}})));
    return;
  }
  wire_bytes_ = wire_.Length();
  if (const absl::Status charged = memory_.Wait(wire_bytes_); !charged.ok()) {
    Refuse(charged);
  } else {
    Queue();
  }
}

void IncomingCall::OnCancel() {
  call_.Cancel();
  runtime_->delays->Hurry(this);
}

void IncomingCall::Run() {
  if (refusal_.has_value()) {
    Finish(*refusal_);
  } else {
    Work();
  }
}

void IncomingCall::Refuse(const absl::Status& status) {
  LogEnd("", status, 0, 0);
  FinishRefused(ForCaller(status));
}

void IncomingCall::FinishRefused(const grpc::Status& status) {
  // After Finish or Add another thread may have deleted this.
  if (wire_bytes_ <= kLongBytes || call_.cancelled()) {
    Finish(status);
    return;
  }
  DropWork();
  wire_.Clear();
  packed_.Clear();
  memory_.StopWaiting();
  memory_.Resize(0).IgnoreError();
  refusal_ = status;
  // In time for the caller to learn why, and not only that its deadline has passed.
  constexpr std::chrono::milliseconds kBeforeDeadline{100};
  runtime_->delays->Add(
      this, std::min(call_.deadline() - kBeforeDeadline,
                     runtime_->connections->RefusalDue(connection_.get(), wire_bytes_)));
}

size_t IncomingCall::EstimateBytes(size_t bytes_max) {
  // Long requests one at a time, so that a flood of them keeps one core busy and not all.
  static std::mutex long_requests;
  std::unique_lock lock(long_requests, std::defer_lock);
  if (wire_bytes_ > kLongBytes) lock.lock();
  return method_->cost.Bytes(&wire_, bytes_max);
}

absl::Status IncomingCall::Parse(Message* request) {
  // As messages, and as what the engine makes of them: a commit of 4 MB of objects took 1.4 times
  // its messages' estimate in all.
  constexpr size_t kShares = 2;
  // One byte above the limit is enough to refuse the call.
  const size_t bytes = EstimateBytes(runtime_->memory->bytes_max_of_call() / kShares + 1) * kShares;
  DSG_RETURN_IF_ERROR(method_->info.waits_for_memory ? memory_.AwaitResize(bytes, call_)
                                                     : memory_.Resize(bytes));
  const grpc::Status parsed =
      grpc::GenericDeserialize<grpc::ProtoBufferReader, Message>(&wire_, request);
  wire_.Clear();
  memory_.StopWaiting();
  return parsed.ok() ? absl::OkStatus() : UnreadableError(*request, wire_bytes_);
}

absl::Status IncomingCall::Pack(const Message& message) {
  bool own = false;
  packed_.Clear();
  const grpc::Status packed =
      grpc::GenericSerialize<grpc::ProtoBufferWriter, Message>(message, &packed_, &own);
  if (!packed.ok()) return absl::InternalError(packed.error_message());
  const size_t bytes = packed_.Length();
  if (bytes <= static_cast<size_t>(kMessageBytesMaxOnWire)) return absl::OkStatus();
  packed_.Clear();
  return TooLongError(bytes);
}

grpc::Status IncomingCall::ForCaller(const absl::Status& status) {
  const absl::Status shown = HideFolder(status, runtime_->store_folder);
  std::string detail = EncodeErrorDetail(shown);
  if (!detail.empty()) context_->AddTrailingMetadata(kErrorTrailer, std::move(detail));
  return ToGrpc(shown);
}

bool IncomingCall::WantsLog(const absl::Status& status) const {
  return runtime_->log.Wants(status, query::CallContext::Clock::now() - begin_);
}

void IncomingCall::LogEnd(std::string_view map, const absl::Status& status, int64_t revision,
                          int64_t row_count) const {
  const auto elapsed = query::CallContext::Clock::now() - begin_;
  if (!runtime_->log.Wants(status, elapsed)) return;
  runtime_->log.Write(
      {method_->info.name, map, status, revision, row_count, elapsed, connection_->peer});
}

}  // namespace dsg::server
