// SPDX-License-Identifier: Apache-2.0
// A running server: it listens, bounds what it accepts, and stops in order. It has no domain logic.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "query/service/service_core.h"
#include "server/http/http_options.h"
#include "server/tls/tls_context.h"

namespace dsg::server {

/// Whether gRPC clients may ask for the protos (server reflection).
enum class Reflection {
  /// On a unix socket and on loopback only.
  kLocal,
  kOn,
  kOff,
};

struct ServerOptions {
  /// "unix:PATH" or "HOST:PORT".
  std::string listen;
  /// Threads that answer calls; 0 = two per core, at least four.
  int worker_count = 0;
  /// Calls queued and running at a time; more are refused at once.
  int in_flight_max = 256;
  /// Streams open at a time, whether they are being written or wait for their reader. Each holds
  /// one message of at most 1000 poses or a mesh block, and what gRPC buffers.
  int open_stream_max = 128;
  /// Watches open at a time. A waiting watch polls the head revision every 50 ms; a watch that
  /// sends changes holds the keys of one revision.
  int open_watch_max = 256;
  /// Connections at a time, at most half of the process's descriptor limit; more are closed at
  /// once.
  int connection_max = 1024;
  /// Memory for the requests and replies of all calls, in bytes; calls that need more are refused.
  /// One call or one connection gets at most half of it.
  size_t call_memory_bytes = size_t{256} << 20;
  /// A stream or watch ends when its reader takes no message for this long.
  std::chrono::milliseconds reader_stall_max{30'000};
  /// Who may call, and do what: a path for AccessControl::Open; empty = everybody everything.
  std::string access_file;
  /// Encrypts connections over TCP, gRPC and HTTP, if it has a certificate.
  TlsOptions tls;
  /// Where it is written who changed what; empty = nowhere. The key seals it; empty = none.
  std::string audit_file;
  std::string audit_key_file;
  /// Of a unix socket: who may connect, as chmod has it. Who may do what is for `access_file`.
  unsigned socket_mode = 0600;
  /// Listen on addresses that other machines can reach, although nothing is encrypted or nobody is
  /// asked who calls.
  bool allow_remote = false;
  Reflection reflection = Reflection::kLocal;
  /// A log line for every call, not only for errors and slow ones.
  bool log_all_calls = false;
  /// The HTTP port beside gRPC; off unless it has an address.
  HttpOptions http;

  /// Errors: FIELD_INVALID outside of these ranges: workers 0 to 256; calls, streams and
  /// connections 1 to 65536; watches 0 to 65536; memory from 16 MiB; stall 1 ms to 1 h.
  absl::Status Validate() const;
};

/// Load of the workers for questions at one instant.
struct ServerLoad {
  /// Workers that run a call or make a message of a stream.
  int running_count = 0;
  /// Calls and streams that wait for a worker.
  int queued_count = 0;
  /// Open streams without watches.
  int open_stream_count = 0;
  int open_watch_count = 0;
};

class Server {
 public:
  /// Starts a server, which listens when this returns.
  ///
  /// Errors: those of ServerOptions::Validate, ParseListenAddress, UnixSocketClaim::Take and
  /// HttpPort::Listen; UNAVAILABLE with the address and the system's reason when the server cannot
  /// listen there.
  static absl::StatusOr<std::unique_ptr<Server>> Start(std::unique_ptr<query::ServiceCore> core,
                                                       const ServerOptions& options);

  /// Shuts down with a grace of one second.
  virtual ~Server() = default;

  /// The address that clients dial, with the actual port.
  virtual const std::string& address() const = 0;

  /// What to open over HTTP, with the token; empty if the server has no HTTP port.
  virtual std::string http_url() const = 0;

  virtual ServerLoad Load() const = 0;

  /// Takes the access file and the certificates as they are now, and begins another audit log if
  /// the one before was moved. Of what is wrong, that before stays in force. Errors: those of
  /// AccessControl, ConnectionFront and CallAudit, all in one.
  virtual absl::Status Reload() = 0;

  /// Reports not-ready, accepts no more calls, lets running calls end within `grace`, cancels the
  /// rest and joins the workers. Further calls do nothing. Must not be called from a handler.
  virtual void Shutdown(std::chrono::milliseconds grace) = 0;
};

}  // namespace dsg::server
