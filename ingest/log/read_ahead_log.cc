// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/read_ahead_log.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

namespace dsg::ingest {
namespace {

class ReadAheadLog : public LogSource {
 public:
  ReadAheadLog(std::unique_ptr<LogSource> log, size_t count_max)
      : log_(std::move(log)),
        count_max_(count_max),
        info_(log_->info()),
        reader_([this](const std::stop_token& stop) { Read(stop); }) {}

  const LogInfo& info() const override { return info_; }
  // Only the reader waits, who must not call what belongs to the caller's thread.
  void SetIdle(std::function<absl::Status()> /*idle*/) override {}

  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (is_ended_) return std::nullopt;
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !ahead_.empty(); });
    Item item = std::move(ahead_.front());
    ahead_.pop_front();
    changed_.notify_all();
    is_ended_ = IsLast(item);
    // The reader has put it there as the last thing that it did.
    if (is_ended_) info_ = log_->info();
    return item;
  }

 private:
  using Item = absl::StatusOr<std::optional<Measurement>>;

  static bool IsLast(const Item& item) { return !item.ok() || !item->has_value(); }

  void Read(const std::stop_token& stop) {
    // A log that waits for its file may wait for ever.
    log_->SetIdle([stop] {
      return stop.stop_requested() ? absl::CancelledError("nobody reads the log")
                                   : absl::OkStatus();
    });
    for (bool is_last = false; !is_last;) {
      Item item = log_->Next();
      is_last = IsLast(item);
      std::unique_lock<std::mutex> lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return ahead_.size() < count_max_; })) return;
      ahead_.push_back(std::move(item));
      changed_.notify_all();
    }
  }

  const std::unique_ptr<LogSource> log_;
  const size_t count_max_;
  LogInfo info_;
  bool is_ended_ = false;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  /// Guarded by `mutex_`.
  std::deque<Item> ahead_;
  // Uses all of the above.
  std::jthread reader_;
};

}  // namespace

std::unique_ptr<LogSource> ReadAhead(std::unique_ptr<LogSource> log, size_t count_max) {
  return std::make_unique<ReadAheadLog>(std::move(log), count_max);
}

}  // namespace dsg::ingest
