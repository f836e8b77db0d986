// SPDX-License-Identifier: Apache-2.0
// Ends a call at its deadline even while its reader does not read. gRPC does so only for callers
// that gave a deadline; the others would keep a stream open for ever.
#pragma once

#include <memory>
#include <mutex>

#include "grpcpp/alarm.h"
#include "grpcpp/grpcpp.h"
#include "query/engine/call_context.h"

namespace dsg::server {

class DeadlineGuard {
 public:
  DeadlineGuard(grpc::CallbackServerContext* context,
                query::CallContext::Clock::time_point deadline)
      : shared_(std::make_shared<Shared>()) {
    shared_->context = context;
    if (deadline == query::CallContext::Clock::time_point::max()) return;
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

}  // namespace dsg::server
