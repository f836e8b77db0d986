// SPDX-License-Identifier: Apache-2.0
// Open connections and the cost of each. A connection that begins calls faster than they end, or
// resets calls before it has sent their requests, is closed: gRPC 1.51 keeps 20 kB for each reset
// call and does not count it as open, so its own limits do not bound them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/access/access_control.h"

namespace dsg::server {

/// One connection, from its accept until its last call has ended.
struct Connection {
  /// Owned by gRPC, whose is valid while a call of the connection exists, or by the HTTP port.
  int fd = -1;
  /// Distinguishes the socket from a later one with the same descriptor number.
  uint64_t cookie = 0;
  /// Address of the peer, as the log shows it.
  std::string peer;
  /// Who it is, as far as the connection tells.
  Peer identity;
  std::atomic<int> call_count{0};
  /// The part of CallMemory that its calls hold.
  std::atomic<size_t> waiting_bytes{0};
  std::atomic<size_t> held_bytes{0};
  std::atomic<bool> closed{false};
  std::mutex mutex;
  /// Leaky-bucket count of resets at time `resets_at`. Guarded by `mutex`.
  double resets = 0.0;
  std::chrono::steady_clock::time_point resets_at{};
  /// When the last of its long requests that were refused is answered. Guarded by `mutex`.
  std::chrono::steady_clock::time_point refused_until{};
};

struct ConnectionLimits {
  /// Connections at a time.
  int connection_max = 1024;
  /// Calls of one connection that have begun and not ended. gRPC allows 64 that the client waits
  /// for; the others are cancelled calls that the server has not finished yet.
  int call_max = 512;
  /// Calls that one connection may reset before their requests have arrived: burst, and rate per
  /// second.
  double reset_burst = 1000.0;
  double resets_per_s = 100.0;
  /// How much one connection may send in requests that are refused. Reading four mebibytes costs
  /// several milliseconds of a processor, and whoever asks in vain asks again at once.
  double refused_bytes_per_s = 1 << 20;
  /// The longest that a refusal waits, whatever was refused before it. Many clients may share the
  /// connection of a proxy.
  std::chrono::milliseconds refusal_pause_max{10'000};
};

/// Threads: safe from any thread.
class Connections {
 public:
  explicit Connections(const ConnectionLimits& limits) : limits_(limits) {}

  /// Registers an accepted socket before it is used. nullptr when there are too many.
  [[nodiscard]] std::shared_ptr<Connection> Add(int fd, const std::string& peer,
                                                const Peer& identity = {});
  /// The connection of a call; `name` is the peer name that gRPC gives.
  std::shared_ptr<Connection> Find(const std::string& name);

  /// Counts a call that begins; EndCall must follow. False when the connection has been closed and
  /// the call must be refused.
  [[nodiscard]] bool BeginCall(Connection* connection);
  void EndCall(Connection* connection) { --connection->call_count; }
  /// Counts a call that ended before its request arrived. Closes the connection if that happens too
  /// often.
  void CountReset(Connection* connection);
  /// When a refusal of a request of `bytes` is due. One connection's come one after another.
  std::chrono::steady_clock::time_point RefusalDue(Connection* connection, size_t bytes) const;

  int open_count() const;

 private:
  void Close(Connection* connection, const std::string& why);
  // Removes connections whose sockets are closed. Requires: mutex_ held.
  void Sweep();

  const ConnectionLimits limits_;
  mutable std::mutex mutex_;
  // By descriptor. A reused descriptor means that the former connection is closed.
  std::unordered_map<int, std::shared_ptr<Connection>> by_fd_;
  bool full_ = false;
  // Stands for the connection of a call from an unknown socket, which should not happen.
  const std::shared_ptr<Connection> nobody_ = std::make_shared<Connection>();
};

}  // namespace dsg::server
