// SPDX-License-Identifier: Apache-2.0
#include "server/served_call.h"

#include <google/protobuf/io/zero_copy_stream.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
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

query::CallContext::Clock::time_point DeadlineOf(const Method& method, CallerDeadline deadline) {
  const bool lasts = method.is_stream && method.info.lifetime != query::Lifetime::kAnswer;
  return lasts ? WatchDeadline(deadline) : BoundDeadline(deadline);
}

}  // namespace

absl::Status CheckMessageBytes(size_t bytes) {
  if (bytes <= static_cast<size_t>(kMessageBytesMaxOnWire)) return absl::OkStatus();
  return MakeError(
      Reason::kLimitExceeded,
      absl::StrCat("the reply has ", bytes, " bytes, and a message at most ",
                   kMessageBytesMaxOnWire, "; ask for less at a time"),
      {{"bytes", absl::StrCat(bytes)}, {"bytes_max", absl::StrCat(kMessageBytesMaxOnWire)}});
}

ServedCall::ServedCall(const Method* method, CallWire* wire, std::shared_ptr<Connection> connection,
                       CallerDeadline deadline)
    : method_(method),
      wire_(wire),
      call_(DeadlineOf(*method, deadline)),
      connection_(std::move(connection)),
      memory_(method->runtime->memory, connection_) {}

ServedCall::~ServedCall() { runtime().connections->EndCall(connection_.get()); }

bool ServedCall::Admit(absl::StatusOr<KnownCaller> caller) {
  absl::Status status = caller.status();
  if (!runtime().connections->BeginCall(connection_.get())) {
    status = OverloadedError("the connection has more calls than it may have, and was closed");
  } else if (status.ok()) {
    known_ = *std::move(caller);
    status = CheckRole();
  }
  if (status.ok()) return true;
  Refuse(status);
  return false;
}

absl::Status ServedCall::CheckRole() const {
  const query::Role needed = method_->info.role;
  if (caller().HighestRole() >= needed) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat("\"", caller().name(), "\" may not call ", std::string(method_->info.name),
                   ": that needs the role ", std::string(NameOf(needed)),
                   ", which it has in no map; ask who keeps the server's access file"));
}

void ServedCall::Begin() {
  request_bytes_ = wire_->request_bytes();
  if (const absl::Status charged = memory_.Wait(request_bytes_); !charged.ok()) {
    Refuse(charged);
  } else {
    Queue();
  }
}

void ServedCall::GiveUp() {
  // Not logged: a flood of resets would fill the log.
  runtime().connections->CountReset(connection_.get());
  wire_->Finish(ForCaller(MakeError(
      Reason::kFieldInvalid, "the call ended before its request had come whole; send one message",
      {{"field", ""}})));
}

void ServedCall::Cancel() {
  call_.Cancel();
  runtime().delays->Hurry(this);
}

void ServedCall::Run() {
  if (refusal_.has_value()) {
    wire_->Finish(*refusal_);
  } else {
    Work();
  }
}

void ServedCall::Refuse(const absl::Status& status) {
  LogEnd("", status, 0, 0);
  EndAudit("", status, 0);
  FinishRefused(status);
}

void ServedCall::FinishRefused(const absl::Status& status) {
  // After Finish or Add another thread may have deleted this.
  if (request_bytes_ <= kLongBytes || call_.cancelled()) {
    wire_->Finish(ForCaller(status));
    return;
  }
  DropWork();
  wire_->Drop();
  memory_.StopWaiting();
  memory_.Resize(0).IgnoreError();
  refusal_ = ForCaller(status);
  // In time for the caller to learn why, and not only that its deadline has passed.
  constexpr std::chrono::milliseconds kBeforeDeadline{100};
  runtime().delays->Add(
      this, std::min(call_.deadline() - kBeforeDeadline,
                     runtime().connections->RefusalDue(connection_.get(), request_bytes_)));
}

absl::Status ServedCall::Charge(size_t bytes) {
  return method_->info.waits_for_memory ? memory_.AwaitResize(bytes, call_) : memory_.Resize(bytes);
}

size_t ServedCall::EstimateBytes(size_t bytes_max) {
  // Long requests one at a time, so that a flood of them keeps one core busy and not all.
  static std::mutex long_requests;
  std::unique_lock lock(long_requests, std::defer_lock);
  if (request_bytes_ > kLongBytes) lock.lock();
  return method_->cost->Bytes(wire_->OpenRequest().get(), bytes_max);
}

absl::Status ServedCall::Parse(Message* request) {
  // As messages, and as what the engine makes of them: a commit of 4 MB of objects took 1.4 times
  // its messages' estimate in all.
  constexpr size_t kShares = 2;
  if (wire_->decode_bytes() > 0) DSG_RETURN_IF_ERROR(Charge(wire_->decode_bytes()));
  DSG_RETURN_IF_ERROR(wire_->Decode(*request->GetDescriptor()));
  // One byte above the limit is enough to refuse the call.
  const size_t bytes = EstimateBytes(runtime().memory->bytes_max_of_call() / kShares + 1) * kShares;
  DSG_RETURN_IF_ERROR(Charge(bytes));
  const bool is_parsed = request->ParseFromZeroCopyStream(wire_->OpenRequest().get());
  wire_->Drop();
  memory_.StopWaiting();
  if (!is_parsed) return UnreadableError(*request, request_bytes_);
  return CheckAccess(*request);
}

absl::Status ServedCall::CheckAccess(const Message& request) {
  // A head may have come long before its request.
  if (runtime().access->generation() != known_.generation) {
    is_refused_ = true;
    return absl::UnauthenticatedError(
        "who may call was changed while the request came; call again");
  }
  other_map_ = method_->maps->OtherOf(request);
  absl::Status status = method_->maps->Check(caller(), request);
  is_refused_ = !status.ok();
  return status;
}

absl::Status ServedCall::ForCaller(const absl::Status& status) const {
  return HideFolder(status, method_->runtime->store_folder);
}

std::string_view ServedCall::CallerName() const {
  return known_.caller == nullptr ? std::string_view() : caller().name();
}

AuditedCall ServedCall::Audited(std::string_view map) const {
  return {&method_->info, CallerName(), connection_->peer, map, other_map_, is_refused_};
}

absl::Status ServedCall::BeginAudit(std::string_view map) const {
  return method_->runtime->audit->Begin(Audited(map));
}

void ServedCall::EndAudit(std::string_view map, const absl::Status& status,
                          int64_t revision) const {
  method_->runtime->audit->End(Audited(map), status, revision);
}

bool ServedCall::WantsLog(const absl::Status& status) const {
  return method_->runtime->log.Wants(status, query::CallContext::Clock::now() - begin_);
}

void ServedCall::LogEnd(std::string_view map, const absl::Status& status, int64_t revision,
                        int64_t row_count) const {
  const auto elapsed = query::CallContext::Clock::now() - begin_;
  const CallLog& log = method_->runtime->log;
  if (!log.Wants(status, elapsed)) return;
  log.Write({method_->info.name, map, status, revision, row_count, elapsed, connection_->peer,
             std::string(CallerName())});
}

}  // namespace dsg::server
