// SPDX-License-Identifier: Apache-2.0
// The sockets that a server listens on, and the thread that accepts from them. gRPC 1.51 could do
// both, but it crashes when it runs out of descriptors and cannot close a single connection.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "server/listen_address.h"

namespace dsg::server {

/// Hands over each connection at once, so that the server speaks first, as links expect.
class Acceptor {
 public:
  using Clock = std::chrono::steady_clock;
  /// Gets an accepted socket, which does not block and is now its to close, and its peer as the log
  /// shows it. Called on the acceptor's thread.
  using Take = std::function<void(int fd, const std::string& peer)>;

  /// Listens; clients may connect from now on and wait for Start. A unix socket is for its user
  /// only, and is removed in the end.
  ///
  /// Errors: UNAVAILABLE naming the address and the system's reason.
  static absl::StatusOr<std::unique_ptr<Acceptor>> Listen(const ListenAddress& address);
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  /// With the port that was taken.
  const ListenAddress& address() const { return address_; }

  void Start(Take take);
  /// Accepts no more and closes the sockets. Further calls do nothing.
  void Stop();

 private:
  explicit Acceptor(ListenAddress address);
  absl::Status ListenOnSocket();
  absl::Status ListenOnHost();
  void Run();
  void Accept(int listener);

  ListenAddress address_;
  std::vector<int> listeners_;
  int wakeup_fd_ = -1;
  // No accept before, after the system had no descriptor.
  Clock::time_point pause_until_{};
  Take take_;
  std::thread thread_;
};

}  // namespace dsg::server
