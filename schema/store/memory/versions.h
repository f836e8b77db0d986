// SPDX-License-Identifier: Apache-2.0
// Things by their keys, with all that was ever believed of them.
#pragma once

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "schema/model/ids.h"

namespace dsg::memory {

template <typename Key, typename Value>
class Versions {
 public:
  /// Believed during [from, to).
  struct Version {
    Revision from = 0;
    Revision to = kRevisionMax;
    Value value;
    bool is_current() const { return to == kRevisionMax; }
    bool IsShown(Revision revision) const { return from <= revision && revision < to; }
  };

  /// What a revision shows; null if nothing.
  const Version* Find(const Key& key, Revision revision) const {
    const auto found = all_.find(key);
    if (found == all_.end()) return nullptr;
    for (const Version& version : found->second) {
      if (version.IsShown(revision)) return &version;
    }
    return nullptr;
  }
  /// What is believed at the head; null if nothing.
  const Version* Current(const Key& key) const { return Find(key, kRevisionMax - 1); }

  /// Requires: nothing is current.
  void Put(const Key& key, Revision now, Value value) {
    all_[key].push_back({now, kRevisionMax, std::move(value)});
  }
  /// Ends what is current, if anything is. What began in the same revision was never shown.
  void End(const Key& key, Revision now) {
    const auto found = all_.find(key);
    if (found == all_.end() || found->second.empty()) return;
    Version& last = found->second.back();
    if (!last.is_current()) return;
    last.to = now;
    if (last.from == now) found->second.pop_back();
    if (found->second.empty()) all_.erase(found);
  }

  /// Any version, current or past. False, and nothing done, if it overlaps with another.
  bool Insert(const Key& key, Version version) {
    std::vector<Version>& versions = all_[key];
    const auto next =
        std::upper_bound(versions.begin(), versions.end(), version.from,
                         [](Revision from, const Version& other) { return from < other.from; });
    const bool is_free = version.from < version.to &&
                         (next == versions.begin() || (next - 1)->to <= version.from) &&
                         (next == versions.end() || version.to <= next->from);
    if (is_free) versions.insert(next, std::move(version));
    return is_free;
  }

  /// Calls `visit(key, version)` for each version, ascending by key and then by revision.
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    for (const auto& [key, versions] : all_) {
      for (const Version& version : versions) visit(key, version);
    }
  }
  /// Calls `visit(version)` for each version of one key, ascending by revision.
  template <typename Visit>
  void ForEachOf(const Key& key, const Visit& visit) const {
    const auto found = all_.find(key);
    if (found == all_.end()) return;
    for (const Version& version : found->second) visit(version);
  }
  template <typename Visit>
  void ForEachAt(Revision revision, const Visit& visit) const {
    ForEach([&](const Key& key, const Version& version) {
      if (version.IsShown(revision)) visit(key, version);
    });
  }
  /// The same, and the version may be changed.
  template <typename Visit>
  void Change(const Visit& visit) {
    for (auto& [key, versions] : all_) {
      for (Version& version : versions) visit(key, version);
    }
  }

  /// Takes out the versions for which `goes(key, version)` is true. Returns their number.
  template <typename Goes>
  int64_t EraseIf(const Goes& goes) {
    int64_t count = 0;
    for (auto it = all_.begin(); it != all_.end();) {
      count += static_cast<int64_t>(std::erase_if(
          it->second, [&](const Version& version) { return goes(it->first, version); }));
      it = it->second.empty() ? all_.erase(it) : std::next(it);
    }
    return count;
  }

 private:
  /// Ascending in time, and none overlap.
  std::map<Key, std::vector<Version>> all_;
};

}  // namespace dsg::memory
