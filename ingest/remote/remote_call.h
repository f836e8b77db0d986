// SPDX-License-Identifier: Apache-2.0
// One gRPC call as our code sees it: errors with their reasons, transport failures repeated.
// Refuses to repeat what the server has answered.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// A message to the server may be so long; what is longer is refused before it is sent.
inline constexpr int kSendBytesMax = 4 << 20;
/// An answer may be so long: a page of nodes, or 1000 poses.
inline constexpr int kReceiveBytesMax = 64 << 20;

/// Without proxies, compression and service configs from elsewhere.
std::shared_ptr<grpc::Channel> OpenChannel(const std::string& address);

/// The error of a call, with the reason and metadata of the trailer "dsg-error-bin".
absl::Status ToStatus(const grpc::ClientContext& context, const grpc::Status& status);

/// Runs `attempt` with a fresh context until it succeeds, fails for good, or `retry_ns_max` has
/// passed. Repeated are transport failures (UNAVAILABLE without a reason), a server that is
/// shutting down or overloaded, and a commit of unknown outcome; so the call must be idempotent.
///
/// Errors: of the last attempt; UNAVAILABLE names `address`.
absl::Status CallWithRetry(const std::string& address, TimeNs retry_ns_max,
                           const std::function<grpc::Status(grpc::ClientContext*)>& attempt);

}  // namespace dsg::ingest
