// SPDX-License-Identifier: Apache-2.0
// One call that answers with a stream. Between two messages it is only memory: no worker waits for
// a reader.
#pragma once

#include <memory>
#include <string_view>

#include "grpcpp/grpcpp.h"
#include "schema/base/status.h"
#include "server/call_deadline.h"
#include "server/call_runtime.h"
#include "server/deadline_guard.h"
#include "server/status_mapping.h"
#include "server/unary_call.h"

namespace dsg::server {

/// The method of ServiceCore that opens the stream.
template <typename Request, typename Reply>
using OpenStream = absl::StatusOr<std::unique_ptr<query::StreamCursor<Reply>>> (
    query::ServiceCore::*)(const Request&);

// Run and OnWriteDone take turns, so one message is in flight at most, and Finish comes once.
template <typename Request, typename Reply>
class StreamCall final : public grpc::ServerWriteReactor<Reply>, public Job {
 public:
  StreamCall(CallRuntime* runtime, std::string_view method, OpenStream<Request, Reply> open,
             grpc::CallbackServerContext* context, const Request* request)
      : runtime_(runtime),
        method_(method),
        open_(open),
        context_(context),
        request_(request),
        deadline_(BoundDeadline(context->deadline())),
        call_(deadline_),
        guard_(context, deadline_) {
    const int open_count = runtime_->open_stream_count.fetch_add(1) + 1;
    if (open_count > runtime_->open_stream_max || !runtime_->workers->TrySubmit(this)) {
      this->Finish(LastWords(OverloadedError()));
    }
  }

  void Run() override {
    const absl::Status status = ReadNext();
    // After each of these another thread may have deleted this.
    if (!status.ok()) {
      this->Finish(LastWords(status));
    } else if (cursor_->done()) {
      this->StartWriteAndFinish(&message_, grpc::WriteOptions(), LastWords(status));
    } else {
      this->StartWrite(&message_);
    }
  }

  void OnWriteDone(bool ok) override {
    // StartWriteAndFinish has already said the last word.
    if (cursor_->done()) return;
    if (ok) {
      runtime_->workers->Resubmit(this);
    } else {
      this->Finish(LastWords(absl::CancelledError("the reader left, or the deadline passed")));
    }
  }

  void OnCancel() override { call_.Cancel(); }

  void OnDone() override {
    runtime_->open_stream_count.fetch_sub(1);
    delete this;
  }

 private:
  absl::Status ReadNext() {
    DSG_RETURN_IF_ERROR(call_.Check());
    if (cursor_ == nullptr) {
      DSG_ASSIGN_OR_RETURN(cursor_, (runtime_->core->*open_)(*request_));
    }
    message_.Clear();
    DSG_RETURN_IF_ERROR(cursor_->Next(call_, &message_));
    if (message_.has_header()) revision_ = message_.header().read_revision();
    row_count_ += RowCountOf(message_);
    return absl::OkStatus();
  }

  // Logs the call and prepares its trailers.
  grpc::Status LastWords(const absl::Status& status) {
    const auto elapsed = query::CallContext::Clock::now() - begin_;
    if (runtime_->log.Wants(status, elapsed)) {
      runtime_->log.Write(
          {method_, request_->map(), status, revision_, row_count_, elapsed, context_->peer()});
    }
    if (!status.ok()) AddErrorTrailer(status, context_);
    return ToGrpc(status);
  }

  CallRuntime* runtime_;
  const std::string_view method_;
  const OpenStream<Request, Reply> open_;
  grpc::CallbackServerContext* context_;
  const Request* request_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  const query::CallContext::Clock::time_point deadline_;
  query::CallContext call_;
  DeadlineGuard guard_;
  std::unique_ptr<query::StreamCursor<Reply>> cursor_;
  Reply message_;
  int64_t revision_ = 0;
  int64_t row_count_ = 0;
};

/// What the handler returns; deletes itself. `request` belongs to gRPC and lives as long as it;
/// `method` must be a literal.
template <typename Request, typename Reply>
grpc::ServerWriteReactor<Reply>* StartStream(CallRuntime* runtime, std::string_view method,
                                             OpenStream<Request, Reply> open,
                                             grpc::CallbackServerContext* context,
                                             const Request* request) {
  return new StreamCall<Request, Reply>(runtime, method, open, context, request);
}

}  // namespace dsg::server
