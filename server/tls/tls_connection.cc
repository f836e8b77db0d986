// SPDX-License-Identifier: Apache-2.0
#include <openssl/err.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "server/tls/tls_connection_internal.h"

namespace dsg::server {
namespace {

// Chunks that one direction copies before other connections have their turn, and records in one: a
// client may send records of a byte, each of which costs as much as one of a kilobyte.
constexpr int kTurnChunks = 4;
constexpr int kChunkRecords = 16;

bool WouldBlock(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

// Why OpenSSL gave up, from its queue and the result of the check of the certificate.
std::string HandshakeReason(const SSL* ssl, int system_error) {
  const bool is_certificate = ERR_GET_REASON(ERR_peek_error()) == SSL_R_CERTIFICATE_VERIFY_FAILED;
  std::string reason = TakeOpensslReason();
  if (reason.empty()) {
    return system_error != 0 ? std::strerror(system_error) : "the client closed the connection";
  }
  if (is_certificate) {
    reason += std::string(": ") + X509_verify_cert_error_string(SSL_get_verify_result(ssl));
  }
  return reason;
}

// A socket that is closed with bytes unread is reset, and the client may lose the alert that tells
// it why.
void DropWhatCame(int fd) {
  char bytes[4096];
  for (int i = 0; i < 16; ++i) {
    if (recv(fd, bytes, sizeof(bytes), MSG_DONTWAIT) <= 0) return;
  }
}

}  // namespace

OwnedFd& OwnedFd::operator=(OwnedFd&& other) noexcept {
  if (this != &other) {
    Reset();
    fd_ = other.Release();
  }
  return *this;
}

int OwnedFd::Release() { return std::exchange(fd_, -1); }

void OwnedFd::Reset() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

void Leftover::Keep(std::span<const char> bytes) {
  bytes_.assign(bytes.begin(), bytes.end());
  begin_ = 0;
}

void Leftover::Drop(size_t count) {
  begin_ += count;
  if (empty()) *this = Leftover();
}

TlsConnection::TlsConnection(OwnedFd tcp_fd, std::shared_ptr<const TlsContext> context)
    : tcp_fd_(std::move(tcp_fd)), context_(std::move(context)), ssl_(SSL_new(context_->get())) {
  if (ssl_ == nullptr) return;
  SSL_set_accept_state(ssl_.get());
  if (SSL_set_fd(ssl_.get(), tcp_fd_.get()) != 1) ssl_.reset();
}

TlsConnection::~TlsConnection() { DropWhatCame(tcp_fd_.get()); }

TlsConnection::Turn TlsConnection::Shake() {
  ERR_clear_error();
  if (ssl_ == nullptr) {
    why_ = "out of memory";
    return Turn::kOver;
  }
  errno = 0;
  const int result = SSL_do_handshake(ssl_.get());
  if (result == 1) return Turn::kMore;
  const int system_error = errno;
  const int error = SSL_get_error(ssl_.get(), result);
  if (error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE) return Turn::kWaits;
  // Load balancers look in like this every few seconds.
  const bool is_probe = BIO_number_read(SSL_get_rbio(ssl_.get())) == 0;
  if (!is_probe) why_ = HandshakeReason(ssl_.get(), system_error);
  ERR_clear_error();
  shutdown(tcp_fd_.get(), SHUT_WR);
  return Turn::kOver;
}

std::string TlsConnection::ClientName() const {
  const X509* certificate = SSL_get0_peer_certificate(ssl_.get());
  return certificate == nullptr ? "" : NameInCertificate(certificate);
}

void TlsConnection::MarkTcp(uint32_t events) {
  can_read_tls_ = true;
  can_write_tls_ = true;
  // Otherwise reading finds it, after what came before.
  if ((events & EPOLLERR) != 0 && in_ended_) client_gone_ = true;
}

void TlsConnection::MarkPlain(uint32_t events) {
  can_read_plain_ = true;
  can_write_plain_ = true;
  // Closed, or it sends no more and has been told that nothing comes.
  if ((events & (EPOLLHUP | EPOLLERR)) != 0) {
    plain_deaf_ = true;
    plain_gone_ = true;
  }
}

TlsConnection::Turn TlsConnection::Copy(std::span<char> chunk) {
  const bool more_in = CopyIn(chunk);
  const bool more_out = CopyOut(chunk);
  // What the client sent before it went is passed on first.
  if (client_gone_ && (in_.empty() || plain_deaf_)) return Turn::kOver;
  // A client that has ended, or has been told that nobody listens.
  if (out_done_ && (in_done_ || (plain_deaf_ && in_ended_))) return Turn::kOver;
  return more_in || more_out ? Turn::kMore : Turn::kWaits;
}

TlsConnection::Closing TlsConnection::closing() const {
  if (out_done_ && plain_deaf_) return Closing::kDrains;
  return client_gone_ || plain_gone_ ? Closing::kDelivers : Closing::kNot;
}

bool TlsConnection::CopyIn(std::span<char> chunk) {
  for (int i = 0; i < kTurnChunks; ++i) {
    if (!in_.empty()) in_.Drop(WritePlain(in_.rest()));
    // Read on, so that the client can finish, and forget it.
    if (plain_deaf_) in_ = Leftover();
    if (!in_.empty()) return false;
    if (in_ended_) {
      EndIn();
      return false;
    }
    if (!can_read_tls_) return false;
    const size_t size = ReadTls(chunk);
    const std::span<const char> bytes = chunk.first(size);
    if (size > 0) in_.Keep(bytes.subspan(WritePlain(bytes)));
  }
  return true;
}

bool TlsConnection::CopyOut(std::span<char> chunk) {
  for (int i = 0; i < kTurnChunks; ++i) {
    if (client_gone_ || out_done_) return false;
    if (!out_.empty()) out_.Drop(WriteTls(out_.rest()));
    if (!out_.empty()) return false;
    if (out_ended_) {
      EndOut();
      return false;
    }
    if (!can_read_plain_) return false;
    const size_t size = ReadPlain(chunk);
    const std::span<const char> bytes = chunk.first(size);
    if (size > 0) out_.Keep(bytes.subspan(WriteTls(bytes)));
  }
  return true;
}

// Several records, so that the plain socket gets them at once.
size_t TlsConnection::ReadTls(std::span<char> chunk) {
  size_t size = 0;
  for (int i = 0; i < kChunkRecords && size < chunk.size() && !client_gone_; ++i) {
    ERR_clear_error();
    size_t got = 0;
    const int result = SSL_read_ex(ssl_.get(), chunk.data() + size, chunk.size() - size, &got);
    if (result == 1) {
      size += got;
      continue;
    }
    if (SSL_get_error(ssl_.get(), result) == SSL_ERROR_ZERO_RETURN) {
      in_ended_ = true;
      break;
    }
    if (IsWaiting(result)) {
      can_read_tls_ = false;
      break;
    }
  }
  return size;
}

size_t TlsConnection::ReadPlain(std::span<char> chunk) {
  const ssize_t got = recv(plain_fd_.get(), chunk.data(), chunk.size(), 0);
  if (got > 0) return static_cast<size_t>(got);
  if (got < 0 && WouldBlock(errno)) {
    can_read_plain_ = false;
    return 0;
  }
  out_ended_ = true;
  // Reset: closed with bytes unread.
  if (got < 0) plain_deaf_ = plain_gone_ = true;
  return 0;
}

size_t TlsConnection::WriteTls(std::span<const char> bytes) {
  size_t size = 0;
  while (size < bytes.size() && can_write_tls_ && !client_gone_) {
    ERR_clear_error();
    size_t put = 0;
    const int result = SSL_write_ex(ssl_.get(), bytes.data() + size, bytes.size() - size, &put);
    if (result == 1) {
      size += put;
    } else if (IsWaiting(result)) {
      can_write_tls_ = false;
    }
  }
  return size;
}

size_t TlsConnection::WritePlain(std::span<const char> bytes) {
  size_t size = 0;
  while (size < bytes.size() && can_write_plain_ && !plain_deaf_) {
    const ssize_t put =
        send(plain_fd_.get(), bytes.data() + size, bytes.size() - size, MSG_NOSIGNAL);
    if (put >= 0) {
      size += static_cast<size_t>(put);
    } else if (WouldBlock(errno)) {
      can_write_plain_ = false;
    } else {
      plain_deaf_ = true;
    }
  }
  return size;
}

void TlsConnection::EndIn() {
  if (in_done_ || client_gone_) return;
  shutdown(plain_fd_.get(), SHUT_WR);
  in_done_ = true;
}

void TlsConnection::EndOut() {
  if (!can_write_tls_) return;
  ERR_clear_error();
  const int result = SSL_shutdown(ssl_.get());
  if (result >= 0) {
    shutdown(tcp_fd_.get(), SHUT_WR);
    out_done_ = true;
  } else if (IsWaiting(result)) {
    can_write_tls_ = false;
  }
}

bool TlsConnection::IsWaiting(int result) {
  const int error = SSL_get_error(ssl_.get(), result);
  if (error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE) return true;
  // After any other error OpenSSL must not be called again for this connection.
  client_gone_ = true;
  in_ended_ = true;
  ERR_clear_error();
  return false;
}

}  // namespace dsg::server
