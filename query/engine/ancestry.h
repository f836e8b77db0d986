// SPDX-License-Identifier: Apache-2.0
// What stands above a place or room, in the form that replies carry it, kept per opened map and
// revision because every question "where was" asks for the same few places again and again.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/bounded_cache.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

struct Ancestry {
  /// Nearest first.
  std::vector<std::string> ids;
  /// The first of kind building; empty when there is none.
  std::string building_id;
};

/// Threads: safe from many threads.
class AncestryCache {
 public:
  /// All that stands above the place of a stay, or above its room when it names no place. When the
  /// hierarchy does not put the place below the room of the stay, the stay is believed: the room
  /// and all above it.
  absl::StatusOr<std::shared_ptr<const Ancestry>> Find(const Snapshot& snapshot, const Stay& stay);

 private:
  struct Key {
    uint64_t opening = 0;
    Revision revision = 0;
    NodeId place;
    NodeId room;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    size_t operator()(const Key& key) const noexcept;
  };

  // About 20 MB; a building has some thousand places, of which one revision is asked at a time.
  BoundedCache<Key, std::shared_ptr<const Ancestry>, KeyHash> entries_{65'536};
};

}  // namespace dsg::query
