// SPDX-License-Identifier: Apache-2.0
// What accepted connections go through before anybody reads what they send: nothing on a unix
// socket, TLS on TCP if the server has a certificate; and what they tell of who is there.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "server/access/access_control.h"
#include "server/listen.h"
#include "server/tls/tls_context.h"
#include "server/tls/tls_terminator.h"

namespace dsg::server {

/// Threads: safe from any thread, except Stop and the destructor.
class ConnectionFront {
 public:
  enum class Protocol { kGrpc, kHttp };
  /// Takes ownership of a socket whose bytes are plain. Called on the acceptor's thread, or on one
  /// of TLS.
  using Take = std::function<void(int fd, const Peer& identity)>;

  /// Without a certificate nothing is encrypted. `connection_max`: as TlsTerminatorOptions.
  ///
  /// Errors: those of TlsContext::Load and TlsTerminator::Start.
  static absl::StatusOr<std::unique_ptr<ConnectionFront>> Open(const TlsOptions& options,
                                                               int connection_max);

  bool encrypts() const { return terminator_ != nullptr; }

  /// Takes ownership of an accepted socket.
  void Pass(int fd, bool is_unix, Protocol protocol, const std::string& peer, Take take);

  /// Reads certificates, key and authorities again. Connections that are open keep theirs.
  ///
  /// Errors: those of TlsContext::Load; then what was read before stays in force.
  absl::Status Reload();

  /// As TlsTerminator::Stop.
  void Stop(std::chrono::milliseconds grace);

 private:
  struct Contexts {
    std::shared_ptr<const TlsContext> grpc;
    std::shared_ptr<const TlsContext> http;
  };

  explicit ConnectionFront(TlsOptions options) : options_(std::move(options)) {}

  const TlsOptions options_;
  std::mutex mutex_;
  /// Guarded by `mutex_`.
  Contexts contexts_;
  /// Null without a certificate.
  std::unique_ptr<TlsTerminator> terminator_;
};

}  // namespace dsg::server
