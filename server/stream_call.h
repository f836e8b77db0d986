// SPDX-License-Identifier: Apache-2.0
// A call that answers with a stream. Between two messages it occupies no worker, whether it waits
// for its reader or for new revisions.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <utility>

#include "schema/base/status.h"
#include "server/served_call.h"

namespace dsg::server {

/// The method of Api that opens the stream.
template <typename Request, typename Reply>
using OpenStream = query::CursorOr<Reply> (query::Api::*)(const query::CallContext&,
                                                          const Request&);

// Run, the delay queue and OnSent alternate, so that one message is made at a time, and Finish is
// called once.
template <typename Request, typename Reply>
class StreamCall final : public ServedCall {
 public:
  StreamCall(const Method* method, OpenStream<Request, Reply> open, CallWire* on,
             std::shared_ptr<Connection> connection, CallerDeadline deadline)
      : ServedCall(method, on, std::move(connection), deadline),
        open_(open),
        place_(runtime().guard->Guard(wire().ender(), call().deadline())) {}
  ~StreamCall() override { DropWork(); }

  void OnSent(bool ok) override {
    place_->EndWrite();
    // SendLast has already sent the status.
    if (cursor_->done()) return;
    if (ok) {
      runtime().workers->Resubmit(this);
    } else {
      wire().Finish(LastWords(absl::CancelledError("the reader left, or the deadline passed")));
    }
  }

  void OnProgress() override { place_->Progress(); }

 private:
  void Work() override {
    const absl::StatusOr<std::chrono::nanoseconds> wait = Prepare();
    // After each of these another thread may have deleted this.
    if (!wait.ok() && cursor_ == nullptr) {
      FinishRefused(LastWords(wait.status()));
    } else if (!wait.ok()) {
      wire().Finish(LastWords(wait.status()));
    } else if (wait->count() > 0) {
      runtime().delays->Add(this, Timer::Clock::now() + *wait);
    } else {
      Write();
    }
  }

  bool is_watch() const { return method().info.lifetime == query::Lifetime::kWatch; }
  std::atomic<int>& open_count() {
    return is_watch() ? runtime().open_watch_count : runtime().open_stream_count;
  }

  void DropWork() override {
    Request().Swap(&request_);
    if (std::exchange(is_counted_, false)) open_count().fetch_sub(1);
  }

  void Queue() override {
    const absl::Status begun = Begin();
    if (!begun.ok()) Refuse(begun);
  }

  absl::Status Begin() {
    const int count = open_count().fetch_add(1) + 1;
    is_counted_ = true;
    if (is_watch() && count > runtime().open_watch_max) {
      return TooManyWatchesError(runtime().open_watch_max);
    }
    if (!is_watch() && count > runtime().open_stream_max) return OverloadedError(kTooManyCalls);
    return runtime().workers->TrySubmit(this, JobKind::kStream) ? absl::OkStatus()
                                                                : OverloadedError(kTooManyCalls);
  }

  // Time until there may be something to send; 0 for now.
  absl::StatusOr<std::chrono::nanoseconds> Prepare() {
    DSG_RETURN_IF_ERROR(call().Check());
    const bool ends_by_itself = method().info.lifetime == query::Lifetime::kAnswer;
    if (!ends_by_itself && runtime().stopping) return ShuttingDownError();
    if (cursor_ == nullptr) {
      DSG_RETURN_IF_ERROR(Parse(&request_));
      DSG_RETURN_IF_ERROR(BeginAudit(request_.map()));
      DSG_ASSIGN_OR_RETURN(cursor_, (runtime().core->*open_)(call(), request_));
    }
    return cursor_->Wait();
  }

  void Write() {
    const absl::StatusOr<bool> has_message = ReadNext();
    if (!has_message.ok() || !*has_message) {
      wire().Finish(LastWords(has_message.status()));
      return;
    }
    place_->BeginWrite();
    if (cursor_->done()) {
      wire().SendLast(LastWords(absl::OkStatus()));
    } else {
      wire().Send();
    }
  }

  // Packs the next message; the message itself is freed before it is sent. False: the stream has
  // ended.
  absl::StatusOr<bool> ReadNext() {
    Reply message;
    DSG_ASSIGN_OR_RETURN(const bool has_message, cursor_->Next(call(), &message));
    if (!has_message) return false;
    if constexpr (requires { message.has_header(); }) {
      if (message.has_header()) revision_ = message.header().read_revision();
    }
    row_count_ += RowCountOf(message);
    DSG_RETURN_IF_ERROR(wire().Pack(message));
    return true;
  }

  // Logs the call and prepares its status. A call that the guard ended looks cancelled from inside,
  // so the guard's verdict replaces the status.
  absl::Status LastWords(absl::Status status) {
    if (const absl::Status verdict = place_->verdict(); !verdict.ok()) status = verdict;
    LogEnd(request_.map(), status, revision_, row_count_);
    EndAudit(request_.map(), status, revision_);
    return ForCaller(status);
  }

  const OpenStream<Request, Reply> open_;
  const std::unique_ptr<CallGuard::Place> place_;
  bool is_counted_ = false;
  Request request_;
  std::unique_ptr<query::StreamCursor<Reply>> cursor_;
  int64_t revision_ = 0;
  int64_t row_count_ = 0;
};

}  // namespace dsg::server
