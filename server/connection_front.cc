// SPDX-License-Identifier: Apache-2.0
#include "server/connection_front.h"

#include <utility>

#include "schema/base/status.h"

namespace dsg::server {

absl::StatusOr<std::unique_ptr<ConnectionFront>> ConnectionFront::Open(const TlsOptions& options,
                                                                       int connection_max) {
  std::unique_ptr<ConnectionFront> front(new ConnectionFront(options));
  if (options.certificate_file.empty()) return front;
  DSG_RETURN_IF_ERROR(front->Reload());
  TlsTerminatorOptions limits;
  limits.connection_max = connection_max;
  DSG_ASSIGN_OR_RETURN(front->terminator_, TlsTerminator::Start(limits));
  return front;
}

absl::Status ConnectionFront::Reload() {
  if (options_.certificate_file.empty()) return absl::OkStatus();
  Contexts read;
  DSG_ASSIGN_OR_RETURN(read.grpc, TlsContext::Load(options_, {"h2"}));
  DSG_ASSIGN_OR_RETURN(read.http, TlsContext::Load(options_, {"http/1.1"}));
  std::lock_guard lock(mutex_);
  contexts_ = std::move(read);
  return absl::OkStatus();
}

void ConnectionFront::Pass(int fd, bool is_unix, Protocol protocol, const std::string& peer,
                           Take take) {
  if (is_unix) {
    take(fd, PeerOfUnixSocket(fd));
    return;
  }
  if (!encrypts()) {
    take(fd, Peer());
    return;
  }
  std::shared_ptr<const TlsContext> context;
  {
    std::lock_guard lock(mutex_);
    context = protocol == Protocol::kGrpc ? contexts_.grpc : contexts_.http;
  }
  terminator_->Accept(fd, std::move(context), peer,
                      [take = std::move(take)](int plain_fd, const std::string& client) {
                        Peer identity;
                        identity.certificate = client;
                        take(plain_fd, identity);
                      });
}

void ConnectionFront::Stop(std::chrono::milliseconds grace) {
  if (terminator_ != nullptr) terminator_->Stop(grace);
}

}  // namespace dsg::server
