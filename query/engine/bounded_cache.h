// SPDX-License-Identifier: Apache-2.0
// What questions look up again and again, remembered. Keys name what was opened
// (MapReader::opening) and the revision, so nothing remembered is ever wrong; a full cache forgets
// everything, which is rare and cheap to make good.
#pragma once

#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

namespace dsg::query {

/// Threads: safe from many threads. Values are copied out, so they should be small or shared.
template <typename Key, typename Value, typename Hash>
class BoundedCache {
 public:
  explicit BoundedCache(size_t entry_count_max) : entry_count_max_(entry_count_max) {}

  std::optional<Value> Find(const Key& key) {
    std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    if (found == entries_.end()) return std::nullopt;
    return found->second;
  }

  void Insert(const Key& key, const Value& value) {
    std::lock_guard lock(mutex_);
    if (entries_.size() >= entry_count_max_) entries_.clear();
    entries_.try_emplace(key, value);
  }

 private:
  const size_t entry_count_max_;
  std::mutex mutex_;
  std::unordered_map<Key, Value, Hash> entries_;
};

}  // namespace dsg::query
