// SPDX-License-Identifier: Apache-2.0
// How a server listens: the address that it is given, the claim on the path of a unix socket, and
// the sockets with the thread that accepts connections. gRPC 1.51 could open the sockets itself,
// but it crashes when it runs out of descriptors and cannot close a single connection.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::server {

struct ListenAddress {
  /// Set for a unix socket.
  std::string socket_path;
  /// Set otherwise. IPv6 hosts without brackets.
  std::string host;
  int port = 0;

  bool is_unix() const { return !socket_path.empty(); }
  /// A unix socket or a loopback host: no other machine reaches it.
  bool is_local() const;
  /// As a client dials it: "unix:/run/dsg.sock", "[::1]:4410".
  std::string ToString() const;
};

/// Reads "unix:PATH" or "HOST:PORT"; port 0 takes a free port. Only loopback hosts are accepted
/// unless `allow_remote`, because nothing is encrypted.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for another form, a path too long for a socket, and for a
/// host that is not loopback unless `allow_remote`.
absl::StatusOr<ListenAddress> ParseListenAddress(std::string_view text, bool allow_remote);

/// The exclusive right to listen on the path of a unix socket. Held until destroyed.
class UnixSocketClaim {
 public:
  /// Locks "<path>.lock" and removes the socket that a killed server left at `path`. Refuses to
  /// remove a socket on which a process answers. The lock file stays: if it were removed, two
  /// servers could lock two files of the same name.
  ///
  /// Errors: UNAVAILABLE/WRITER_LOCKED when another server listens there; FIELD_INVALID when
  /// something other than a socket is at `path`, or the folder cannot be written.
  static absl::StatusOr<std::unique_ptr<UnixSocketClaim>> Take(const std::string& path);

  ~UnixSocketClaim();
  UnixSocketClaim(const UnixSocketClaim&) = delete;
  UnixSocketClaim& operator=(const UnixSocketClaim&) = delete;

 private:
  explicit UnixSocketClaim(int lock_fd) : lock_fd_(lock_fd) {}
  int lock_fd_;
};

/// Accepts connections and hands each over at once, so that the server can send its HTTP/2 settings
/// before the client sends anything.
class Acceptor {
 public:
  using Clock = std::chrono::steady_clock;
  /// Takes ownership of an accepted, non-blocking socket. `peer` is its address as the log shows
  /// it. Called on the acceptor's thread.
  using Take = std::function<void(int fd, const std::string& peer)>;

  /// Listens. Clients can connect from now on; their connections wait for Start. `socket_mode`: who
  /// may connect to a unix socket, by default its user only; Stop removes it.
  ///
  /// Errors: UNAVAILABLE with the address and the system's reason.
  static absl::StatusOr<std::unique_ptr<Acceptor>> Listen(const ListenAddress& address,
                                                          unsigned socket_mode = 0600);
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  /// The address listened on, with the actual port.
  const ListenAddress& address() const { return address_; }

  void Start(Take take);
  /// Stops accepting and closes the sockets. Further calls do nothing.
  void Stop();

 private:
  explicit Acceptor(ListenAddress address);
  absl::Status ListenOnSocket(unsigned socket_mode);
  absl::Status ListenOnHost();
  void Run();
  void Accept(int listener);

  ListenAddress address_;
  std::vector<int> listeners_;
  int wakeup_fd_ = -1;
  // After the system ran out of descriptors, nothing is accepted before this time.
  Clock::time_point pause_until_{};
  Take take_;
  std::thread thread_;
};

}  // namespace dsg::server
