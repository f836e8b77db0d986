// SPDX-License-Identifier: Apache-2.0
// A running server: it binds, bounds what it accepts, and stops in order. Domain logic is not here.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "query/service/service_core.h"

namespace dsg::server {

struct ServerOptions {
  /// "unix:PATH" or "HOST:PORT".
  std::string listen;
  /// Threads that answer calls; 0 = two a core, at least four.
  int worker_count = 0;
  /// Calls queued and running at a time; more are refused at once.
  int in_flight_max = 256;
  /// Streams open at a time, whether they are written to or wait for their reader. Each holds one
  /// message of at most 1000 poses or a mesh block, and what gRPC buffers.
  int open_stream_max = 128;
  /// Watches open at a time. A waiting one costs a look at the head each 50 ms; one that sends what
  /// changed holds the keys of one revision.
  int open_watch_max = 256;
  /// Connections at a time, and never more than half of the descriptors that the process may have;
  /// more are closed at once.
  int connection_max = 1024;
  /// Memory of the requests and replies of all calls; those that would take more are refused. One
  /// call, or one connection, gets at most half of it.
  size_t call_memory_bytes = size_t{256} << 20;
  /// A stream or watch whose reader takes no message for so long is ended.
  std::chrono::milliseconds reader_stall_max{30'000};
  /// Listen on addresses that other machines can reach.
  bool allow_remote = false;
  /// A log line for every call, not only for errors and slow ones.
  bool log_all_calls = false;

  /// Errors: FIELD_INVALID; workers are 0 to 256, calls, streams and connections 1 to 65536,
  /// watches from 0, memory is from 16 MiB, the stall is 1 ms to an hour.
  absl::Status Validate() const;
};

/// What the workers of questions are at, at one instant.
struct ServerLoad {
  /// Workers that are at a call or at a message of a stream.
  int running_count = 0;
  /// Calls and streams that wait for a worker.
  int queued_count = 0;
  /// Streams, watches excepted, that have begun and not ended.
  int open_stream_count = 0;
  int open_watch_count = 0;
};

class Server {
 public:
  /// Listens when it returns.
  ///
  /// Errors: what ParseListenAddress and UnixSocketClaim::Take return; UNAVAILABLE when the address
  /// is taken, naming it and the system's reason.
  static absl::StatusOr<std::unique_ptr<Server>> Start(std::unique_ptr<query::ServiceCore> core,
                                                       const ServerOptions& options);

  /// As Shutdown with a grace of a second.
  virtual ~Server() = default;

  /// What a client dials, with the port that was taken.
  virtual const std::string& address() const = 0;

  virtual ServerLoad Load() const = 0;

  /// Reports not-ready, accepts no more calls, lets the running ones end within `grace`, cancels
  /// the rest, joins the workers. Further calls do nothing. Never from a handler.
  virtual void Shutdown(std::chrono::milliseconds grace) = 0;
};

}  // namespace dsg::server
