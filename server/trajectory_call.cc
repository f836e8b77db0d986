// SPDX-License-Identifier: Apache-2.0
#include "server/trajectory_call.h"

#include <memory>
#include <mutex>

#include "dsg/v1/query_service.pb.h"
#include "grpcpp/alarm.h"
#include "server/unary_call.h"

namespace dsg::server {
namespace {

// Ends a call at its deadline even while its reader does not read. gRPC does so only for callers
// that gave a deadline; the others would keep a stream open for ever.
class DeadlineGuard {
 public:
  DeadlineGuard(grpc::CallbackServerContext* context,
                query::CallContext::Clock::time_point deadline)
      : shared_(std::make_shared<Shared>()) {
    shared_->context = context;
    const auto left = deadline - query::CallContext::Clock::now();
    alarm_.Set(std::chrono::system_clock::now() +
                   std::chrono::duration_cast<std::chrono::system_clock::duration>(left),
               [shared = shared_](bool expired) {
                 std::lock_guard lock(shared->mutex);
                 if (expired && shared->context != nullptr) shared->context->TryCancel();
               });
  }

  // The context dies with the call; the alarm's last callback may come later.
  ~DeadlineGuard() {
    std::lock_guard lock(shared_->mutex);
    shared_->context = nullptr;
  }

 private:
  struct Shared {
    // Recursive, because TryCancel may run the end of the call, and so our destructor, inside.
    std::recursive_mutex mutex;
    grpc::CallbackServerContext* context = nullptr;
  };

  std::shared_ptr<Shared> shared_;
  grpc::Alarm alarm_;
};

// Run and OnWriteDone take turns, so one message is in flight at most, and Finish comes once.
class TrajectoryCall final : public grpc::ServerWriteReactor<v1::GetTrajectoryResponse>,
                             public Job {
 public:
  TrajectoryCall(CallRuntime* runtime, grpc::CallbackServerContext* context,
                 const v1::GetTrajectoryRequest* request)
      : runtime_(runtime),
        context_(context),
        request_(request),
        deadline_(BoundDeadline(context->deadline())),
        call_(deadline_),
        guard_(context, deadline_) {
    const int open_count = runtime_->open_stream_count.fetch_add(1) + 1;
    if (open_count > runtime_->open_stream_max || !runtime_->workers->TrySubmit(this)) {
      Finish(LastWords(OverloadedError()));
    }
  }

  void Run() override {
    const absl::Status status = ReadNext();
    // After each of these another thread may have deleted this.
    if (!status.ok()) {
      Finish(LastWords(status));
    } else if (cursor_->done()) {
      StartWriteAndFinish(&message_, grpc::WriteOptions(), LastWords(status));
    } else {
      StartWrite(&message_);
    }
  }

  void OnWriteDone(bool ok) override {
    // StartWriteAndFinish has already said the last word.
    if (cursor_->done()) return;
    if (ok) {
      runtime_->workers->Resubmit(this);
    } else {
      Finish(LastWords(absl::CancelledError("the reader left, or the deadline passed")));
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
      DSG_ASSIGN_OR_RETURN(cursor_, runtime_->core->OpenTrajectory(*request_));
    }
    message_.Clear();
    DSG_RETURN_IF_ERROR(cursor_->Next(call_, &message_));
    if (message_.has_header()) revision_ = message_.header().read_revision();
    pose_count_ += message_.poses_size();
    return absl::OkStatus();
  }

  // Logs the call and prepares its trailers.
  grpc::Status LastWords(const absl::Status& status) {
    const auto elapsed = query::CallContext::Clock::now() - begin_;
    if (runtime_->log.Wants(status, elapsed)) {
      runtime_->log.Write({"GetTrajectory", request_->map(), status, revision_, pose_count_,
                           elapsed, context_->peer()});
    }
    if (!status.ok()) AddErrorTrailer(status, context_);
    return ToGrpc(status);
  }

  CallRuntime* runtime_;
  grpc::CallbackServerContext* context_;
  const v1::GetTrajectoryRequest* request_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  const query::CallContext::Clock::time_point deadline_;
  query::CallContext call_;
  DeadlineGuard guard_;
  std::unique_ptr<query::TrajectoryCursor> cursor_;
  v1::GetTrajectoryResponse message_;
  int64_t revision_ = 0;
  int64_t pose_count_ = 0;
};

}  // namespace

grpc::ServerWriteReactor<v1::GetTrajectoryResponse>* StartTrajectory(
    CallRuntime* runtime, grpc::CallbackServerContext* context,
    const v1::GetTrajectoryRequest* request) {
  return new TrajectoryCall(runtime, context, request);
}

}  // namespace dsg::server
