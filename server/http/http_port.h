// SPDX-License-Identifier: Apache-2.0
// The HTTP port of a server: the calls that it answers over gRPC, by the Connect protocol, for
// browsers, curl and what has no gRPC; and the files of server/web.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/connection_front.h"
#include "server/http/http_options.h"
#include "server/method_table.h"

namespace dsg::server {

/// Threads: one caller at a time.
class HttpPort {
 public:
  /// Listens; nothing is accepted before Start. `methods`, `runtime`, whose connections and
  /// arrivals are shared with gRPC, and `front` must outlive this. An answer ends when its reader
  /// takes nothing of it for `stall_max`.
  ///
  /// Errors: those of ParseListenAddress, UnixSocketClaim::Take, Acceptor::Listen and MakeToken.
  static absl::StatusOr<std::unique_ptr<HttpPort>> Listen(
      const HttpOptions& options, bool allow_remote, std::chrono::milliseconds stall_max,
      const MethodTable* methods, CallRuntime* runtime, ConnectionFront* front);

  /// Shuts down without grace, if it has not been shut down.
  virtual ~HttpPort() = default;

  virtual void Start() = 0;

  /// What a browser opens, "http://127.0.0.1:8080/#token=..."; or "unix:PATH".
  virtual const std::string& url() const = 0;

  /// Accepts no more, closes idle connections, and ends what runs after `grace`: with UNAVAILABLE
  /// where the reader can be told. Returns at once.
  virtual void BeginShutdown(std::chrono::milliseconds grace) = 0;

  /// Waits until all calls have ended and all connections are closed. Requires: BeginShutdown.
  /// Workers may still be leaving their last calls, so they are stopped before this is destroyed.
  virtual void Join() = 0;
};

}  // namespace dsg::server
