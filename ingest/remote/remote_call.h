// SPDX-License-Identifier: Apache-2.0
// One gRPC call as our code sees it: errors with their reasons, transport failures repeated.
// Refuses to repeat what the server has answered.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "ingest/remote/wait_notes.h"
#include "schema/base/random.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// A message to the server may be so long; what is longer is refused before it is sent.
inline constexpr int kSendBytesMax = 4 << 20;
/// An answer may be so long: a page of nodes, or 1000 poses.
inline constexpr int kReceiveBytesMax = 64 << 20;

/// Without proxies, compression and service configs from elsewhere. A connection that is idle is
/// kept alive, so that no router on the way forgets it, and a dead one is noticed within half a
/// minute.
std::shared_ptr<grpc::Channel> OpenChannel(const std::string& address);

/// The error of a call, with the reason and metadata of the trailer "dsg-error-bin".
absl::Status ToStatus(const grpc::ClientContext& context, const grpc::Status& status);

/// Makes calls to one server, one after another, and repeats those that were not answered.
///
/// Threads: one caller at a time.
class ServerCaller {
 public:
  /// `retry_ns_max`: how long a call is repeated. `tell` may be empty.
  ServerCaller(std::string address, TimeNs retry_ns_max, TellWait tell);

  const std::string& address() const { return address_; }

  /// Runs `attempt` with a fresh context until it succeeds, fails for good, or the time is over.
  /// Repeated are transport failures, attempts without an answer within a minute (longer with each
  /// repetition, for slow links), a server that is shutting down or overloaded, and a commit of
  /// unknown outcome; so the call must be idempotent. Pauses grow from 50 ms to 5 s, each drawn
  /// from half of that up, so that robots that were cut off together do not come back together.
  ///
  /// Errors: of the last attempt; UNAVAILABLE and DEADLINE_EXCEEDED name the address.
  absl::Status Call(const std::function<grpc::Status(grpc::ClientContext*)>& attempt);

 private:
  absl::Status Repeat(const std::function<grpc::Status(grpc::ClientContext*)>& attempt,
                      WaitNotes::Clock::time_point give_up);

  const std::string address_;
  const TimeNs retry_ns_max_;
  Random random_;
  WaitNotes notes_;
};

}  // namespace dsg::ingest
