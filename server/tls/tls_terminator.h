// SPDX-License-Identifier: Apache-2.0
// Takes TLS off accepted connections: what follows sees a plain socket with the bytes that the
// client meant. Refuses to make that socket before the client has shown what the context requires.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/tls/tls_context.h"

namespace dsg::server {

struct TlsTerminatorOptions {
  /// Threads that do all handshakes and copying. One copies several hundred megabytes a second.
  int thread_count = 1;
  /// Handshakes at a time; connections beyond are closed at once.
  int handshake_max = 256;
  /// Connections at a time, those in their handshakes and those that are closing too. Each has two
  /// descriptors here, and its plain socket.
  int connection_max = 1024;
  /// How long a handshake may take.
  std::chrono::milliseconds handshake_time_max{5'000};
  /// How long what is in flight may take to reach the other side after one side has closed.
  std::chrono::milliseconds linger{30'000};
};

struct TlsShared;
class TlsLoop;

/// A connection holds at most 64 KiB for each direction besides the buffers of its sockets; where
/// they are full its writer waits, and no other connection does. close_notify of the client and the
/// end of what the plain socket sends are passed on, and the other direction goes on. A client that
/// goes without close_notify ends both directions.
///
/// Threads: safe from any thread, except Stop and the destructor.
class TlsTerminator {
 public:
  /// Takes ownership of the plain socket: non-blocking, close-on-exec, one end of a pair of unix
  /// sockets. `client` is the name in the client's certificate (NameInCertificate); empty if none
  /// is required. Called on a thread of the terminator: it must be short, must not wait and must
  /// not call Stop. Never called for a connection whose handshake fails.
  using Take = std::function<void(int fd, const std::string& client)>;

  /// Starts the threads.
  ///
  /// Errors: UNAVAILABLE when the system gives no descriptors.
  static absl::StatusOr<std::unique_ptr<TlsTerminator>> Start(const TlsTerminatorOptions& options);
  /// As Stop().
  ~TlsTerminator();
  TlsTerminator(const TlsTerminator&) = delete;
  TlsTerminator& operator=(const TlsTerminator&) = delete;

  /// Takes ownership of `fd`, an accepted, non-blocking TCP socket. Returns at once; failures are
  /// logged with `peer`, the address of the client. Closes it when there are too many, and after
  /// Stop.
  void Accept(int fd, std::shared_ptr<const TlsContext> context, std::string peer, Take take);

  /// Ends handshakes, waits at most `grace` until the other connections have closed by themselves,
  /// closes the rest and joins the threads. When it has returned no `take` runs. Further calls do
  /// nothing. Close the plain sockets before, so that the last answers arrive within `grace`.
  void Stop(std::chrono::milliseconds grace = std::chrono::milliseconds(0));

  /// Connections that are open, with those in their handshakes.
  int open_count() const;
  int handshake_count() const;

 private:
  explicit TlsTerminator(const TlsTerminatorOptions& options);

  // Before the loops, which use it.
  std::unique_ptr<TlsShared> shared_;
  std::vector<std::unique_ptr<TlsLoop>> loops_;
};

}  // namespace dsg::server
