// SPDX-License-Identifier: Apache-2.0
// The records of past revisions, made right again after rows of the past were taken out: sums,
// digests, lists of what was touched.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "schema/codec/checksum.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/touched_keys.h"

namespace dsg::sqlite {

/// What a row adds to the record of each revision that shows it.
struct RowSums {
  ContentDigest content;
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t agent_count = 0;
  int64_t pose_count = 0;
  int64_t stay_count = 0;
  int64_t mesh_block_count = 0;
  std::map<LayerId, int64_t> layer_counts;

  RowSums& operator+=(const RowSums& other);
  RowSums& operator-=(const RowSums& other);
};

/// Keys of which the lists of touched keys are to know but the current rows.
template <typename Key>
class Forgotten {
 public:
  void Add(const Key& key, Revision since) {
    const auto [known, is_new] = since_.emplace(key, since);
    if (!is_new) {
      std::erase_if(begins_, [&](const auto& begin) {
        return begin.first == known->second && begin.second == key;
      });
      known->second = since;
    }
    if (since > 0) begins_.emplace(since, key);
  }
  bool contains(const Key& key) const { return since_.contains(key); }
  /// Drops from and adds to the list of `revision`, which also speaks for the revisions after
  /// `before` that are compacted away. True if anything changed.
  bool Edit(Revision before, Revision revision, std::vector<Key>* keys) const {
    const size_t size = keys->size();
    std::erase_if(*keys, [&](const Key& key) {
      const auto since = since_.find(key);
      if (since == since_.end()) return false;
      return since->second <= before || since->second > revision;
    });
    bool is_changed = keys->size() != size;
    const auto end = begins_.upper_bound(revision);
    for (auto begin = begins_.upper_bound(before); begin != end; ++begin) {
      if (std::find(keys->begin(), keys->end(), begin->second) != keys->end()) continue;
      keys->push_back(begin->second);
      is_changed = true;
    }
    return is_changed;
  }

 private:
  std::map<Key, Revision> since_;
  std::multimap<Revision, Key> begins_;
};

/// How the past of a map differs from what its records say.
class PastChange {
 public:
  /// A row that was shown from revision `from` on, until before `to`.
  void Take(const RowSums& row, Revision from, Revision to);
  void Put(const RowSums& row, Revision from, Revision to);

  /// Keys whose rows of the past are gone; a current row begins at revision `since` (0 = there is
  /// none). Edges at a named node need no naming.
  void ForgetNode(NodeId id, Revision since) { nodes_.Add(id, since); }
  void ForgetEdge(const EdgeRowKey& key, Revision since) { edges_.Add(key, since); }
  void ForgetMeshBlock(const BlockIndex& index, Revision since) { mesh_blocks_.Add(index, since); }
  void ForgetTrack(NodeId agent) { tracks_.insert(agent); }

  /// Writes the records anew. Within a transaction.
  absl::Status Apply(Database& db) const;

 private:
  absl::Status ApplySums(Database& db) const;
  absl::StatusOr<bool> ApplyToLists(Database& db) const;
  bool Edit(Revision before, Revision revision, TouchedKeys* keys) const;

  std::map<Revision, RowSums> changes_;
  Forgotten<NodeId> nodes_;
  Forgotten<EdgeRowKey> edges_;
  Forgotten<BlockIndex> mesh_blocks_;
  std::set<NodeId> tracks_;
};

}  // namespace dsg::sqlite
