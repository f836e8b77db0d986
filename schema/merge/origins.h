// SPDX-License-Identifier: Apache-2.0
// Where the nodes of a merged map came from. Origins are attributes of the nodes. When the same
// maps are merged again, origins tell which nodes are the same, and what the tracks of copied
// agents were when they were copied. They hold by content and not by name alone: a map can be
// rebuilt under an old name.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"
#include "schema/model/node.h"
#include "schema/store/graph_store.h"

namespace dsg::merge {

/// "<map>/<id>" of each node of another map that this node stands for, separated by blanks.
inline constexpr char kMergedFrom[] = "merged_from";
/// For each of them: its own observations, the revisions of that map at which it was taken, and
/// checksums of its content: "57@12:<seen>", or "new:57@12:<seen>:<written>" if the node is a copy.
inline constexpr char kMergedCounts[] = "merged_counts";

struct Origin {
  std::string map;
  NodeId id;
  /// Observations made in that map alone.
  int64_t observation_count = 0;
  /// The node is a copy from there, not fused with a node that this map had.
  bool is_copy = false;
  /// Revisions of `map`, ascending. The node was taken from the last one. Agents keep several,
  /// because their tracks are written after them.
  std::vector<Revision> revisions;
  /// MarkOf the node there when it was taken; 0 = unknown.
  uint64_t seen_mark = 0;
  /// MarkOf the copy when it was written here. While it matches, nobody has changed the copy.
  uint64_t written_mark = 0;
};

/// Order: as written.
std::vector<Origin> OriginsOf(const Node& node);

/// Adds `origin`, or replaces the one of the same map and id.
void SetOrigin(Origin origin, Node* node);

/// The only origin of a node that is a copy; nullopt for other nodes.
std::optional<Origin> CopiedFrom(const Node& node);

/// Checksum of all that a merge replaces in a copy: all but id, name and origins, and the box of
/// places and regions, which grows with what they contain. Never 0.
uint64_t MarkOf(const Node& node);

/// Whether only merges of its origin have written this copy. Requires: CopiedFrom is `origin`.
bool IsAsWritten(const Node& node, const Origin& origin);

/// Observations that are not from an origin of the node.
int64_t OwnCount(const Node& node);

/// The sum, saturated.
int64_t AddCounts(int64_t a, int64_t b);

struct KnownPairs {
  /// For each node of `other` the index of the same node of `into`; -1 where unknown.
  std::vector<int> pair_of;
  /// The origin of that node of `into` that names this node of `other`, if any.
  std::vector<std::optional<Origin>> origin_of;
  /// MarkOf each node of `other`.
  std::vector<uint64_t> mark_of;
};

/// Nodes that earlier merges made one. Both maps are in their own frames. An origin holds if its
/// map, at the revision that the origin names, has the node with the same content. If that revision
/// is not readable any more and the node has changed since, the majority of the other origins of
/// that map decides. A null reader means that no past revision is read.
/// Errors: those of reading; what `stop` returned.
absl::StatusOr<KnownPairs> FindKnownPairs(const MapContent& into, const MapContent& other,
                                          MapReader* into_map, MapReader* other_map,
                                          const StopCheck& stop);

/// Whether an origin holds by the newest revision of `source` alone; nullopt if that cannot tell.
std::optional<bool> HoldsNow(const Origin& origin, const MapContent& source);

/// The revisions of the other map from which agents were copied, by its nodes.
struct TrackHistory {
  /// Only for copied agents of which an older revision was merged; null is the revision that is
  /// merged now.
  std::map<int, std::vector<std::shared_ptr<const Snapshot>>> bases;
  /// Agents whose poses may have changed since they were copied.
  std::set<int> changed;
};

/// Revisions that are not readable any more are left out; the tracks then grow but are not
/// corrected. With a null `other_map` none is readable.
/// Errors: those of reading; what `stop` returned.
absl::StatusOr<TrackHistory> ReadTrackHistory(const MapContent& content, const KnownPairs& known,
                                              const Snapshot& other, MapReader* other_map,
                                              const StopCheck& stop);

/// The transform of the last merge of `other`; nullopt if there was none, or `other` has been
/// rebuilt since. Both maps are in their own frames.
std::optional<Pose3d> TransformOfLastMerge(const MapContent& into, const MapContent& other);

}  // namespace dsg::merge
