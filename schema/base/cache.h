// SPDX-License-Identifier: Apache-2.0
// Keeps values that are costly to make: a cache under a bound in bytes, a value that is made once,
// and the single flight below both: callers that want one value at the same time make it once.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/base/stop_check.h"

namespace dsg {

/// Lets one caller at a time make the value of a key. It does not keep values: the owner does.
///
/// Threads: safe from many threads. A maker must not ask for its own key.
template <typename Key>
class SingleFlight {
 public:
  /// What `find` returns, or else what `make` returns. While another caller makes the value of
  /// `key`, this one waits; if the other fails, one of those who wait makes it.
  /// `find` returns a std::optional of the value, `make` an absl::StatusOr of it, and has stored it
  /// where `find` looks. Both run without a lock of this object.
  /// Errors: what this caller's own `stop` or `make` returned, never another caller's.
  template <typename Find, typename Make>
  auto Run(const Key& key, const StopCheck& stop, const Find& find, const Make& make)
      -> decltype(make()) {
    if (auto found = find()) return *std::move(found);
    DSG_RETURN_IF_ERROR(Begin(key, stop));
    const Flight flight(this, key);
    // Another caller may have stored it since the first look.
    if (auto found = find()) return *std::move(found);
    return make();
  }

 private:
  // How long a waiter sleeps between two looks at its own deadline.
  static constexpr std::chrono::milliseconds kWaitSlice{5};

  // Ends what Begin began, however the maker returns.
  class Flight {
   public:
    Flight(SingleFlight* owner, const Key& key) : owner_(owner), key_(key) {}
    ~Flight() { owner_->End(key_); }
    Flight(const Flight&) = delete;
    Flight& operator=(const Flight&) = delete;

   private:
    SingleFlight* owner_;
    const Key& key_;
  };

  absl::Status Begin(const Key& key, const StopCheck& stop) {
    std::unique_lock lock(mutex_);
    while (std::find(keys_.begin(), keys_.end(), key) != keys_.end()) {
      ended_.wait_for(lock, kWaitSlice);
      lock.unlock();
      DSG_RETURN_IF_ERROR(AskStop(stop));
      lock.lock();
    }
    keys_.push_back(key);
    return absl::OkStatus();
  }

  void End(const Key& key) {
    {
      const std::lock_guard lock(mutex_);
      keys_.erase(std::find(keys_.begin(), keys_.end(), key));
    }
    ended_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable ended_;
  // Being made; as many as there are callers that make something.
  std::vector<Key> keys_;
};

/// A value that the first caller makes and that stays.
///
/// Threads: safe from many threads.
template <typename T>
class MakeOnce {
 public:
  /// What the first `make` that succeeds returns, an absl::StatusOr<std::shared_ptr<T>>.
  /// Errors: what this caller's own `stop` or `make` returned, never another caller's.
  template <typename Make>
  absl::StatusOr<std::shared_ptr<T>> Get(const StopCheck& stop, const Make& make) {
    const auto find = [this] {
      return is_made_ ? std::make_optional(value_) : std::optional<std::shared_ptr<T>>();
    };
    return flight_.Run({}, stop, find, [&]() -> absl::StatusOr<std::shared_ptr<T>> {
      DSG_ASSIGN_OR_RETURN(value_, make());
      is_made_ = true;
      return value_;
    });
  }

  /// Null until it is made. Does not wait.
  T* MadeOrNull() const { return is_made_ ? value_.get() : nullptr; }

 private:
  SingleFlight<std::monostate> flight_;
  // Not changed once `is_made_` is set.
  std::shared_ptr<T> value_;
  std::atomic<bool> is_made_ = false;
};

/// A value and what it costs in a cache. Where only the number of entries matters, each costs 1.
template <typename Value>
struct Costed {
  Value value;
  size_t bytes = 0;
};

/// A map from keys, which absl::Hash knows, to values under a bound in bytes. The oldest go first,
/// but for those that were used since they came or were last spared: these are spared once more, so
/// that a hit touches its own entry only. The newest stays, however large: its caller holds it
/// anyway. Values are copied out, so they are small or shared pointers.
///
/// Threads: safe from many threads. Values are destroyed outside the lock.
template <typename Key, typename Value>
class Cache {
 public:
  explicit Cache(size_t bytes_max) : bytes_max_(bytes_max) {}

  std::optional<Value> Find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = index_.find(key);
    if (found == index_.end()) return std::nullopt;
    Entry& entry = *found->second;
    entry.is_used = true;
    return entry.value;
  }

  /// Replaces what is there.
  void Insert(const Key& key, Value value, size_t bytes) {
    Entries dropped;
    const std::lock_guard lock(mutex_);
    if (const auto found = index_.find(key); found != index_.end()) Drop(found->second, &dropped);
    entries_.push_front({key, std::move(value), bytes, false});
    index_.emplace(key, entries_.begin());
    bytes_ += bytes;
    const auto newest = entries_.begin();
    while (bytes_ > bytes_max_ && entries_.size() > 1) {
      const auto oldest = std::prev(entries_.end());
      if (oldest == newest || std::exchange(oldest->is_used, false)) {
        entries_.splice(entries_.begin(), entries_, oldest);
      } else {
        Drop(oldest, &dropped);
      }
    }
  }

  /// What is there, or else what `make` returns, an absl::StatusOr<Costed<Value>>. Callers that ask
  /// for one key at the same time make it once: the others wait, each until its own `stop`.
  /// Errors: what this caller's own `stop` or `make` returned.
  template <typename Make>
  absl::StatusOr<Value> Get(const Key& key, const StopCheck& stop, const Make& make) {
    return flights_.Run(
        key, stop, [&] { return Find(key); },
        [&]() -> absl::StatusOr<Value> {
          DSG_ASSIGN_OR_RETURN(Costed<Value> made, make());
          Insert(key, made.value, made.bytes);
          return std::move(made.value);
        });
  }

  struct Stats {
    size_t bytes = 0;
    int64_t entry_count = 0;
  };
  Stats stats() const {
    const std::lock_guard lock(mutex_);
    return {bytes_, static_cast<int64_t>(entries_.size())};
  }

 private:
  struct Entry {
    Key key;
    Value value;
    size_t bytes;
    // Since it came to the front.
    bool is_used;
  };
  using Entries = std::list<Entry>;

  // The caller destroys what it gets in `dropped` after it has left the lock.
  void Drop(typename Entries::iterator entry, Entries* dropped) {
    bytes_ -= entry->bytes;
    index_.erase(entry->key);
    dropped->splice(dropped->end(), entries_, entry);
  }

  const size_t bytes_max_;
  mutable std::mutex mutex_;
  size_t bytes_ = 0;
  // The newest first.
  Entries entries_;
  absl::flat_hash_map<Key, typename Entries::iterator> index_;
  SingleFlight<Key> flights_;
};

}  // namespace dsg
