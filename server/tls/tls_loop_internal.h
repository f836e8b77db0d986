// SPDX-License-Identifier: Apache-2.0
// A thread of the terminator: epoll, the connections that it was given, and their deadlines.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/tls/tls_connection_internal.h"

namespace dsg::server {

/// Lets one line a second pass, so that a flood does not fill the log.
///
/// Threads: safe from any thread.
class LogLimit {
 public:
  /// How many lines were left out since the last one, if a line may be written now.
  std::optional<int> Pass();

 private:
  std::mutex mutex_;
  std::chrono::steady_clock::time_point next_{};
  int left_out_count_ = 0;
};

/// What the loops of a terminator have in common.
struct TlsShared {
  explicit TlsShared(const TlsTerminatorOptions& chosen) : options(chosen) {}

  const TlsTerminatorOptions options;
  std::atomic<int> open_count{0};
  std::atomic<int> handshake_count{0};
  std::atomic<unsigned> next_loop{0};
  LogLimit failed;
  LogLimit crowded;
  LogLimit starved;
};

/// A connection on its way to its loop. It is counted in TlsShared.
struct TlsArrival {
  OwnedFd fd;
  std::shared_ptr<const TlsContext> context;
  std::string peer;
  TlsTerminator::Take take;
};

class TlsLoop {
 public:
  using Clock = std::chrono::steady_clock;

  explicit TlsLoop(TlsShared* shared) : shared_(shared) {}
  ~TlsLoop();
  TlsLoop(const TlsLoop&) = delete;
  TlsLoop& operator=(const TlsLoop&) = delete;

  /// Errors: UNAVAILABLE when the system gives no descriptors.
  absl::Status Start();
  /// From any thread. False, and the arrival is closed, after BeginStop.
  bool Add(TlsArrival arrival);
  /// Ends handshakes at once and all connections at `deadline`.
  void BeginStop(Clock::time_point deadline);
  /// Requires: BeginStop.
  void Join();

 private:
  struct Entry {
    Entry(TlsArrival arrival);

    TlsConnection connection;
    std::string peer;
    TlsTerminator::Take take;
    bool is_shaking = true;
    bool is_queued = false;
    TlsConnection::Closing closing = TlsConnection::Closing::kNot;
    std::optional<Clock::time_point> deadline;
  };

  void Run();
  // True when it is time to end.
  bool TakeInbox();
  int WaitMs() const;
  void Note(uint64_t tag, uint32_t events);
  void Enqueue(uint64_t id, Entry* entry);
  void ServeQueues();
  void Serve(uint64_t id);
  void Shake(uint64_t id, Entry* entry);
  bool MakePlain(uint64_t id, Entry* entry, OwnedFd* theirs);
  bool Watch(int fd, uint64_t tag);
  void SetDeadline(uint64_t id, Entry* entry, std::optional<Clock::time_point> deadline);
  void Expire();
  void Close(uint64_t id);

  TlsShared* const shared_;
  OwnedFd epoll_fd_;
  OwnedFd wakeup_fd_;
  std::thread thread_;

  std::mutex mutex_;
  // Guarded by `mutex_`.
  std::vector<TlsArrival> inbox_;
  std::optional<Clock::time_point> stop_at_;

  // The rest is the thread's own.
  std::unordered_map<uint64_t, std::unique_ptr<Entry>> entries_;
  uint64_t last_id_ = 0;
  bool stops_ = false;
  std::optional<Clock::time_point> ends_at_;
  std::set<std::pair<Clock::time_point, uint64_t>> deadlines_;
  // Connections that may get on: those that copy, and those in their handshakes.
  std::deque<uint64_t> copying_;
  std::deque<uint64_t> shaking_;
  std::vector<char> chunk_;
};

}  // namespace dsg::server
