// SPDX-License-Identifier: Apache-2.0
// What an erasure names, and what of the lists of touched keys it leaves. A map keeps the list from
// before the erasure's first commit to its last step: by then the rows in which it was found are
// gone. The list holds keys and times, nothing of what is erased.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/graph_store.h"
#include "schema/store/touched_keys.h"

namespace dsg {

struct EraseList {
  /// Nodes, edges and mesh blocks; no tracks.
  TouchedKeys keys;
  std::vector<TrackSpan> spans;
  bool assets = false;

  size_t size() const;
  /// Each thing stands once afterwards, in order, and spans of one agent do not touch.
  void Add(const EraseList& other);
};

/// In order, without relations that the map does not know: there are no edges of them.
/// `find_relation` gives a relation's number, 0 if the map has never seen it.
absl::StatusOr<EraseList> ListOf(
    const Erasure& erasure,
    const std::function<absl::StatusOr<int64_t>(const std::string&)>& find_relation);

/// A noted erasure, sorted into what can be wiped now and what its commits have yet to retire.
struct RipeAndRest {
  EraseList ripe;
  EraseList rest;
};
/// Whether something is believed now as it was when the erasure was noted.
struct BelievedSince {
  std::function<absl::StatusOr<bool>(NodeId)> node;
  std::function<absl::StatusOr<bool>(const EdgeRowKey&)> edge;
  std::function<absl::StatusOr<bool>(const BlockIndex&)> mesh_block;
  std::function<absl::StatusOr<bool>(const TrackSpan&)> span;
};
/// What `named` names too is ripe, and what is not believed any more.
absl::StatusOr<RipeAndRest> SortByRipeness(const EraseList& noted, const EraseList& named,
                                           const BelievedSince& is_believed);

PendingErasure CountsOf(const EraseList& list);

/// What Verify notes of it, and what is to be done.
std::string PendingErasureNote(const PendingErasure& left);

/// INVALID_ARGUMENT/FIELD_INVALID: without its past an agent's track would belong to nobody there.
absl::Status AgentIsThereError(const std::string& map, NodeId agent);

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

/// Keys whose rows of the past are gone; a current row begins at revision `since` (0 = there is
/// none). Edges at a named node need no naming.
class ForgottenKeys {
 public:
  void ForgetNode(NodeId id, Revision since) { nodes_.Add(id, since); }
  void ForgetEdge(const EdgeRowKey& key, Revision since) { edges_.Add(key, since); }
  void ForgetMeshBlock(const BlockIndex& index, Revision since) { mesh_blocks_.Add(index, since); }
  void ForgetTrack(NodeId agent) { tracks_.insert(agent); }

  /// As Forgotten::Edit, for all that was touched. Leaves the keys normalized if they changed.
  bool Edit(Revision before, Revision revision, TouchedKeys* keys) const;

 private:
  Forgotten<NodeId> nodes_;
  Forgotten<EdgeRowKey> edges_;
  Forgotten<BlockIndex> mesh_blocks_;
  std::set<NodeId> tracks_;
};

}  // namespace dsg
