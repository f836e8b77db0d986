// SPDX-License-Identifier: Apache-2.0
// One unary call from the moment gRPC hands it over until it is finished. The handler's thread only
// queues it; a worker asks the engine and finishes it, exactly once, also when it was cancelled.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "grpcpp/grpcpp.h"
#include "schema/base/status.h"
#include "server/call_deadline.h"
#include "server/call_runtime.h"
#include "server/status_mapping.h"

namespace dsg::server {

/// The map that a request names, whichever way it does.
template <typename Request>
std::string_view MapOf(const Request& request) {
  if constexpr (requires { request.delta().map(); }) {
    return request.delta().map();
  } else if constexpr (requires { request.map().name(); }) {
    return request.map().name();
  } else if constexpr (requires { request.map(); }) {
    return request.map();
  } else {
    return {};
  }
}

template <typename Reply>
int64_t RevisionOf(const Reply& reply) {
  if constexpr (requires { reply.header(); }) {
    return reply.header().read_revision();
  } else if constexpr (requires { reply.revision(); }) {
    return reply.revision();
  } else {
    return 0;
  }
}

/// Entries of a list or of a stream's message; 1 for replies that are no list.
template <typename Reply>
int64_t RowCountOf(const Reply& reply) {
  if constexpr (requires { reply.results_size(); }) {
    return reply.results_size();
  } else if constexpr (requires { reply.nodes_size(); }) {
    return reply.nodes_size();
  } else if constexpr (requires { reply.edges_size(); }) {
    return reply.edges_size();
  } else if constexpr (requires { reply.intervals_size(); }) {
    return reply.intervals_size();
  } else if constexpr (requires { reply.revisions_size(); }) {
    return reply.revisions_size();
  } else if constexpr (requires { reply.maps_size(); }) {
    return reply.maps_size();
  } else if constexpr (requires { reply.poses_size(); }) {
    return reply.poses_size();
  } else if constexpr (requires { reply.blocks_size(); }) {
    return reply.blocks_size();
  } else if constexpr (requires { reply.shapes_size(); }) {
    return reply.shapes_size();
  } else {
    return 1;
  }
}

/// Adds the reason's trailer. Must come before Finish.
inline void AddErrorTrailer(const absl::Status& status, grpc::CallbackServerContext* context) {
  std::string detail = EncodeErrorDetail(status);
  if (!detail.empty()) context->AddTrailingMetadata(kErrorTrailer, std::move(detail));
}

/// Deletes itself once gRPC is done with it.
template <typename Request, typename Reply>
class UnaryCall final : public grpc::ServerUnaryReactor, public Job {
 public:
  using Method = absl::Status (query::Api::*)(const query::CallContext&, const Request&, Reply*);

  /// `request` and `reply` belong to gRPC and live until OnDone.
  UnaryCall(CallRuntime* runtime, std::string_view name, Method method,
            grpc::CallbackServerContext* context, const Request* request, Reply* reply)
      : runtime_(runtime),
        name_(name),
        method_(method),
        context_(context),
        request_(request),
        reply_(reply),
        call_(BoundDeadline(context->deadline())) {
    if (!runtime_->workers->TrySubmit(this)) End(OverloadedError());
  }

  void Run() override {
    // A call that has waited past its deadline, or whose caller has left, is not begun.
    absl::Status status = call_.Check();
    if (status.ok()) status = (runtime_->core->*method_)(call_, *request_, reply_);
    End(status);
  }

  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { delete this; }

 private:
  // After Finish another thread may have deleted this.
  void End(const absl::Status& status) {
    const auto elapsed = query::CallContext::Clock::now() - begin_;
    if (runtime_->log.Wants(status, elapsed)) {
      runtime_->log.Write({name_, MapOf(*request_), status, RevisionOf(*reply_),
                           status.ok() ? RowCountOf(*reply_) : 0, elapsed, context_->peer()});
    }
    if (!status.ok()) AddErrorTrailer(status, context_);
    // A reply that nobody takes would be kept for ever.
    if (OutlastsBound(context_->deadline())) {
      place_ = runtime_->guard->Guard(context_->c_call(), CallGuard::Clock::time_point::max());
      place_->BeginWrite();
    }
    Finish(ToGrpc(status));
  }

  CallRuntime* runtime_;
  std::string_view name_;
  Method method_;
  grpc::CallbackServerContext* context_;
  const Request* request_;
  Reply* reply_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  query::CallContext call_;
  std::unique_ptr<CallGuard::Place> place_;
};

/// What a handler returns. `name` must be a literal.
template <typename Request, typename Reply>
grpc::ServerUnaryReactor* StartUnary(CallRuntime* runtime, std::string_view name,
                                     typename UnaryCall<Request, Reply>::Method method,
                                     grpc::CallbackServerContext* context, const Request* request,
                                     Reply* reply) {
  return new UnaryCall<Request, Reply>(runtime, name, method, context, request, reply);
}

}  // namespace dsg::server
