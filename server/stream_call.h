// SPDX-License-Identifier: Apache-2.0
// One call that answers with a stream. Between two messages it is only memory: no worker waits for
// a reader, nor for news.
#pragma once

#include <chrono>
#include <memory>
#include <string_view>

#include "grpcpp/grpcpp.h"
#include "schema/base/status.h"
#include "server/call_deadline.h"
#include "server/call_runtime.h"
#include "server/status_mapping.h"
#include "server/unary_call.h"

namespace dsg::server {

/// The method of ServiceCore that opens the stream.
template <typename Request, typename Reply>
using OpenStream = absl::StatusOr<std::unique_ptr<query::StreamCursor<Reply>>> (
    query::ServiceCore::*)(const Request&);

/// What bounds a stream.
enum class StreamKind {
  /// Ends by itself, and within kDeadlineMax.
  kAnswer,
  /// Lasts as long as its reader wants, and takes what it is told.
  kWatch,
  /// Ends by itself, whenever that is.
  kWork,
};

// Run, the wait for news and OnWriteDone take turns, so one message is in flight at most, and
// Finish comes once.
template <typename Request, typename Reply>
class StreamCall final : public grpc::ServerWriteReactor<Reply>, public Job {
 public:
  StreamCall(CallRuntime* runtime, std::string_view method, StreamKind kind,
             OpenStream<Request, Reply> open, grpc::CallbackServerContext* context,
             const Request* request)
      : runtime_(runtime),
        method_(method),
        kind_(kind),
        open_(open),
        context_(context),
        request_(request),
        call_(kind == StreamKind::kAnswer ? BoundDeadline(context->deadline())
                                          : WatchDeadline(context->deadline())),
        place_(runtime->guard->Guard(context->c_call(), call_.deadline())) {
    const absl::Status begun = Begin();
    if (!begun.ok()) this->Finish(LastWords(begun));
  }

  void Run() override {
    const absl::StatusOr<std::chrono::nanoseconds> wait = Prepare();
    // After each of these another thread may have deleted this.
    if (!wait.ok()) {
      this->Finish(LastWords(wait.status()));
    } else if (wait->count() > 0) {
      runtime_->delays->Add(this, DelayQueue::Clock::now() + *wait);
    } else {
      Write();
    }
  }

  void OnWriteDone(bool ok) override {
    place_->EndWrite();
    // StartWriteAndFinish has already said the last word.
    if (cursor_->done()) return;
    if (ok) {
      runtime_->workers->Resubmit(this);
    } else {
      this->Finish(LastWords(absl::CancelledError("the reader left, or the deadline passed")));
    }
  }

  void OnCancel() override {
    call_.Cancel();
    runtime_->delays->Hurry(this);
  }

  void OnDone() override {
    open_count().fetch_sub(1);
    delete this;
  }

 private:
  bool is_watch() const { return kind_ == StreamKind::kWatch; }
  std::atomic<int>& open_count() {
    return is_watch() ? runtime_->open_watch_count : runtime_->open_stream_count;
  }

  absl::Status Begin() {
    const int count = open_count().fetch_add(1) + 1;
    if (is_watch() && count > runtime_->open_watch_max) {
      return TooManyWatchesError(runtime_->open_watch_max);
    }
    if (!is_watch() && count > runtime_->open_stream_max) return OverloadedError();
    return runtime_->workers->TrySubmit(this, JobKind::kStream) ? absl::OkStatus()
                                                                : OverloadedError();
  }

  // How long until there is something to tell.
  absl::StatusOr<std::chrono::nanoseconds> Prepare() {
    DSG_RETURN_IF_ERROR(call_.Check());
    if (kind_ != StreamKind::kAnswer && runtime_->stopping) return ShuttingDownError();
    if (cursor_ == nullptr) {
      DSG_ASSIGN_OR_RETURN(cursor_, (runtime_->core->*open_)(*request_));
    }
    return cursor_->Wait();
  }

  void Write() {
    const absl::Status status = ReadNext();
    if (!status.ok()) {
      this->Finish(LastWords(status));
      return;
    }
    place_->BeginWrite();
    if (cursor_->done()) {
      this->StartWriteAndFinish(&message_, grpc::WriteOptions(), LastWords(status));
    } else {
      this->StartWrite(&message_);
    }
  }

  absl::Status ReadNext() {
    message_.Clear();
    DSG_RETURN_IF_ERROR(cursor_->Next(call_, &message_));
    if constexpr (requires { message_.has_header(); }) {
      if (message_.has_header()) revision_ = message_.header().read_revision();
    }
    row_count_ += RowCountOf(message_);
    return absl::OkStatus();
  }

  // Logs the call and prepares its trailers. A call that was ended for its reader's sake looks
  // cancelled from inside.
  grpc::Status LastWords(absl::Status status) {
    if (const absl::Status verdict = place_->verdict(); !verdict.ok()) status = verdict;
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
  const StreamKind kind_;
  const OpenStream<Request, Reply> open_;
  grpc::CallbackServerContext* context_;
  const Request* request_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  query::CallContext call_;
  const std::unique_ptr<CallGuard::Place> place_;
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
  return new StreamCall<Request, Reply>(runtime, method, StreamKind::kAnswer, open, context,
                                        request);
}

/// The same for work that has no bound but its own end.
template <typename Request, typename Reply>
grpc::ServerWriteReactor<Reply>* StartWork(CallRuntime* runtime, std::string_view method,
                                           OpenStream<Request, Reply> open,
                                           grpc::CallbackServerContext* context,
                                           const Request* request) {
  return new StreamCall<Request, Reply>(runtime, method, StreamKind::kWork, open, context, request);
}

/// The same for a stream that ends only with its reader.
template <typename Request, typename Reply>
grpc::ServerWriteReactor<Reply>* StartWatch(CallRuntime* runtime, std::string_view method,
                                            OpenStream<Request, Reply> open,
                                            grpc::CallbackServerContext* context,
                                            const Request* request) {
  return new StreamCall<Request, Reply>(runtime, method, StreamKind::kWatch, open, context,
                                        request);
}

}  // namespace dsg::server
