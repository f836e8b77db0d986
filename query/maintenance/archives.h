// SPDX-License-Identifier: Apache-2.0
// Archives on their way to readers: each keeps a copy of its map on the disk, under a bound of
// number and of idle time. An erasure ends the archives of its map, so that no copy outlives it.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/graph_store.h"

namespace dsg {
class ArchiveEncoder;
}  // namespace dsg

namespace dsg::query {

struct ArchiveLimits {
  using Clock = std::chrono::steady_clock;

  /// Archives that are read at a time.
  int count_max = 4;
  /// An archive of which nothing is taken for so long ends.
  std::chrono::nanoseconds idle_max = std::chrono::seconds(60);
  /// For tests; may be empty.
  std::function<Clock::time_point()> now;
};

/// An archive on its way to a reader.
///
/// Threads: Next from one caller at a time; End and EndIfIdle from any.
class ArchiveRead {
 public:
  using Clock = ArchiveLimits::Clock;

  /// The copy is made in folder `scratch`, by the first Next.
  ArchiveRead(std::shared_ptr<MapReader> map, std::string scratch, Clock::time_point now);
  ~ArchiveRead();
  ArchiveRead(const ArchiveRead&) = delete;
  ArchiveRead& operator=(const ArchiveRead&) = delete;

  struct Piece {
    std::string content;
    double progress = 0.0;
    bool is_last = false;
  };
  /// Errors: what ended the archive; of ArchiveMap and ArchiveEncoder.
  absl::StatusOr<Piece> Next(const StopCheck& stop, const ArchiveLimits& limits);

  /// Returns once the copy is gone. `why` is what Next answers from then on.
  void End(absl::Status why);
  /// Whether it did. An archive that is being worked at is not idle.
  bool EndIfIdle(const ArchiveLimits& limits);

  const std::string& map() const { return map_->spec().name; }

 private:
  absl::StatusOr<Piece> Read(const StopCheck& stop);

  const std::shared_ptr<MapReader> map_;
  const std::string scratch_;
  /// Held while it is worked at.
  std::mutex work_mutex_;
  Clock::time_point taken_at_;
  std::unique_ptr<ArchiveEncoder> encoder_;
  std::atomic<bool> is_ended_{false};
  std::mutex why_mutex_;
  absl::Status why_;
};

/// Threads: safe from many threads.
class ArchiveCopies {
 public:
  /// `folder` is the store's. What killed processes left of copies in it is removed.
  ArchiveCopies(std::string folder, ArchiveLimits limits);
  ~ArchiveCopies();
  ArchiveCopies(const ArchiveCopies&) = delete;
  ArchiveCopies& operator=(const ArchiveCopies&) = delete;

  const ArchiveLimits& limits() const { return limits_; }

  /// Errors: RESOURCE_EXHAUSTED/OVERLOADED when enough are being read.
  absl::StatusOr<std::shared_ptr<ArchiveRead>> Begin(std::shared_ptr<MapReader> map);
  /// Once it was read, or nobody will read on.
  void Leave(const ArchiveRead* read);

  /// For whoever erases from a map, before that is acknowledged: no copy made before is left once
  /// this returns, of this process or of killed ones.
  void EndOf(const std::string& map);
  /// A thread does it now and then.
  void EndIdle();

 private:
  void Run();

  const std::string folder_;
  const ArchiveLimits limits_;
  std::mutex mutex_;
  std::condition_variable wakeup_;
  std::vector<std::shared_ptr<ArchiveRead>> reads_;
  bool is_stopped_ = false;
  /// Made with the first archive.
  std::thread thread_;
};

}  // namespace dsg::query
