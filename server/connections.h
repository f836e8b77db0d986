// SPDX-License-Identifier: Apache-2.0
// Who is connected, and what each connection costs. One that begins calls faster than they end, or
// drops calls before it has sent their requests, is closed: gRPC 1.51 takes 20 kB for each call
// that is reset, counts none of them as open, and so bounds nothing.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

namespace dsg::server {

/// One connection, from its accept until its last call has ended.
struct Connection {
  /// gRPC's; valid as long as a call of the connection lives.
  int fd = -1;
  /// Tells the socket from a later one of the same number.
  uint64_t cookie = 0;
  /// As the log shows it.
  std::string peer;
  std::atomic<int> call_count{0};
  /// What its calls hold of CallMemory.
  std::atomic<size_t> waiting_bytes{0};
  std::atomic<size_t> held_bytes{0};
  std::atomic<bool> closed{false};
  std::mutex mutex;
  /// Resets that are not forgiven yet, as of `resets_at`. Guarded by `mutex`.
  double resets = 0.0;
  std::chrono::steady_clock::time_point resets_at{};
  /// When the last of its long requests that were refused is answered. Guarded by `mutex`.
  std::chrono::steady_clock::time_point refused_until{};
};

struct ConnectionLimits {
  /// Connections at a time.
  int connection_max = 1024;
  /// Calls of one connection that have begun and not ended. gRPC lets it have 64 that it waits for;
  /// the others are those that it gave up, and that the server has not got rid of yet.
  int call_max = 512;
  /// Calls that one connection may give up before their requests have arrived: so many at once, and
  /// so many a second.
  double reset_burst = 1000.0;
  double resets_per_s = 100.0;
  /// How much one connection may send in requests that are refused. Reading four mebibytes costs
  /// several milliseconds of a processor, and whoever asks in vain asks again at once.
  double refused_bytes_per_s = 1 << 20;
};

/// Threads: safe from any thread.
class Connections {
 public:
  explicit Connections(const ConnectionLimits& limits) : limits_(limits) {}

  /// Takes note of an accepted socket before gRPC gets it. False when there are too many.
  [[nodiscard]] bool Add(int fd, const std::string& peer);
  /// `name` as gRPC names the connection of a call.
  std::shared_ptr<Connection> Find(const std::string& name);

  /// A call begins, whose end must be told. False when it must be refused, since the connection has
  /// been closed.
  [[nodiscard]] bool BeginCall(Connection* connection);
  void EndCall(Connection* connection) { --connection->call_count; }
  /// A call, which has begun, will get no request. Closes the connection if that is too often.
  void CountReset(Connection* connection);
  /// When a refusal of a request of `bytes` is due. One connection's come one after another.
  std::chrono::steady_clock::time_point RefusalDue(Connection* connection, size_t bytes) const;

  int open_count() const;

 private:
  void Close(Connection* connection, const std::string& why);
  // Forgets those whose sockets are gone. Requires: the lock.
  void Sweep();

  const ConnectionLimits limits_;
  mutable std::mutex mutex_;
  // By descriptor: one that comes again means that the former is closed.
  std::unordered_map<int, std::shared_ptr<Connection>> by_fd_;
  bool full_ = false;
  // For a call that comes from no socket of ours, which does not happen.
  const std::shared_ptr<Connection> nobody_ = std::make_shared<Connection>();
};

}  // namespace dsg::server
