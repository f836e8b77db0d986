// SPDX-License-Identifier: Apache-2.0
// One connection of the terminator: its handshake, and the copying between its TLS side and its
// plain side. It never waits: its loop calls it when a socket may be ready.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/tls/openssl_pointer_internal.h"
#include "server/tls/tls_context.h"
#include "server/tls/tls_terminator.h"

namespace dsg::server {

/// Most bytes that a direction reads before it has passed them on.
inline constexpr size_t kTlsChunkBytes = 64 << 10;

/// A descriptor that is closed when its owner is destroyed; -1 for none.
class OwnedFd {
 public:
  explicit OwnedFd(int fd = -1) : fd_(fd) {}
  ~OwnedFd() { Reset(); }
  OwnedFd(OwnedFd&& other) noexcept : fd_(other.Release()) {}
  OwnedFd& operator=(OwnedFd&& other) noexcept;

  int get() const { return fd_; }
  int Release();
  void Reset();

 private:
  int fd_;
};

/// What was read and could not be passed on yet.
class Leftover {
 public:
  bool empty() const { return begin_ == bytes_.size(); }
  std::span<const char> rest() const { return std::span(bytes_).subspan(begin_); }
  void Keep(std::span<const char> bytes);
  /// Forgets the first `count` bytes, and the memory with the last one.
  void Drop(size_t count);

 private:
  std::vector<char> bytes_;
  size_t begin_ = 0;
};

/// Threads: that of its loop.
class TlsConnection {
 public:
  /// What its loop has to do next: wait for a socket, give it another turn, or close it.
  enum class Turn { kWaits, kMore, kOver };
  /// What the connection may wait for in vain: nothing, what is in flight, or the client's end.
  enum class Closing { kNot, kDelivers, kDrains };

  /// Takes ownership of `tcp_fd`.
  TlsConnection(OwnedFd tcp_fd, std::shared_ptr<const TlsContext> context);
  ~TlsConnection();
  TlsConnection(const TlsConnection&) = delete;
  TlsConnection& operator=(const TlsConnection&) = delete;

  /// Goes on with the handshake: kMore when it is done, kOver when it failed.
  Turn Shake();
  /// Why the handshake failed; empty when the client went before it sent anything.
  const std::string& why() const { return why_; }
  /// The name in the client's certificate. Requires: the handshake is done.
  std::string ClientName() const;
  /// Copies to and from this end of a pair from now on.
  void Join(OwnedFd plain_fd) { plain_fd_ = std::move(plain_fd); }

  /// Notes events of epoll.
  void MarkTcp(uint32_t events);
  void MarkPlain(uint32_t events);
  /// Copies in both directions until both wait or have had their share of the thread.
  Turn Copy(std::span<char> chunk);
  Closing closing() const;

  int tcp_fd() const { return tcp_fd_.get(); }
  int plain_fd() const { return plain_fd_.get(); }

 private:
  // True when there may be more to copy at once.
  bool CopyIn(std::span<char> chunk);
  bool CopyOut(std::span<char> chunk);
  size_t ReadTls(std::span<char> chunk);
  size_t ReadPlain(std::span<char> chunk);
  // Each returns how many bytes were taken.
  size_t WriteTls(std::span<const char> bytes);
  size_t WritePlain(std::span<const char> bytes);
  void EndIn();
  void EndOut();
  // True when OpenSSL only waits for the socket. Otherwise the connection is dead for it.
  bool IsWaiting(int result);

  OwnedFd tcp_fd_;
  OwnedFd plain_fd_;
  const std::shared_ptr<const TlsContext> context_;
  SslPointer ssl_;
  std::string why_;

  // Edges have come since the last try. Either kind of event of the TCP socket lets both of its
  // directions try, because OpenSSL may have to write in order to read.
  bool can_read_tls_ = true;
  bool can_write_tls_ = true;
  bool can_read_plain_ = true;
  bool can_write_plain_ = true;

  // From the client to the plain socket: no more comes; all is passed on, and so is the end.
  Leftover in_;
  bool in_ended_ = false;
  bool in_done_ = false;
  // From the plain socket to the client.
  Leftover out_;
  bool out_ended_ = false;
  bool out_done_ = false;
  // Nothing goes over the TCP socket any more.
  bool client_gone_ = false;
  // The plain socket takes nothing any more; it is closed.
  bool plain_deaf_ = false;
  bool plain_gone_ = false;
};

}  // namespace dsg::server
