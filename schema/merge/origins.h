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

/// "<map>/<id>" of each node of another map that this one stands for, separated by blanks.
inline constexpr char kMergedFrom[] = "merged_from";
/// For each of them: how many observations were its own, at which revisions of that map it was
/// taken, and marks of what it was: "57@12:<seen>", or "new:57@12:<seen>:<written>" where the node
/// came whole from there.
inline constexpr char kMergedCounts[] = "merged_counts";

struct Origin {
  std::string map;
  NodeId id;
  /// Observations made in that map alone.
  int64_t observation_count = 0;
  /// The node was copied from there, and not fused with one that this map had.
  bool is_copy = false;
  /// Of `map`, ascending; the last is that of which the node was taken. Agents have some more, for
  /// their tracks are written after them.
  std::vector<Revision> revisions;
  /// MarkOf the node there, as it was taken; 0 = not known.
  uint64_t seen_mark = 0;
  /// MarkOf the copy, as it was written here: others have not changed it while it is the same.
  uint64_t written_mark = 0;
};

/// Order: as written.
std::vector<Origin> OriginsOf(const Node& node);

/// `origin` is added, or replaces the one of the same map and id.
void SetOrigin(Origin origin, Node* node);

/// The only origin of a node that was copied whole; nullopt for all others.
std::optional<Origin> CopiedFrom(const Node& node);

/// Of all that a merge would replace in a copy: not of its id, name and origins, and not of the box
/// of places and regions, which grows with what they contain. Never 0.
uint64_t MarkOf(const Node& node);

/// Whether nobody but merges of its origin has written this copy. Requires: CopiedFrom is `origin`.
bool IsAsWritten(const Node& node, const Origin& origin);

/// Observations that no origin of the node has made.
int64_t OwnCount(const Node& node);

/// As large as it may be if the sum is larger.
int64_t AddCounts(int64_t a, int64_t b);

struct KnownPairs {
  /// For each node of `other` the index of the node of `into` that it is, -1 where not known.
  std::vector<int> pair_of;
  /// Where the node of `into` has that one as an origin: what is said of it there.
  std::vector<std::optional<Origin>> origin_of;
  /// MarkOf each node of `other`.
  std::vector<uint64_t> mark_of;
};

/// Neither map is carried anywhere yet. An origin holds if its map, at the revision that it names,
/// has that node as it was taken. Where that revision cannot be read any more and the node has
/// changed since, the other origins of that map decide. The readers may be null: then no past
/// revision is read.
/// Errors: those of reading; what `stop` returned.
absl::StatusOr<KnownPairs> FindKnownPairs(const MapContent& into, const MapContent& other,
                                          MapReader* into_map, MapReader* other_map,
                                          const StopCheck& stop);

/// As far as the newest revision of `source` tells: nullopt if it does not.
std::optional<bool> HoldsNow(const Origin& origin, const MapContent& source);

/// By node of the other map.
struct TrackHistory {
  /// Only of agents that were copied whole, and of which an older revision was merged; null stands
  /// for the revision that is merged now.
  std::map<int, std::vector<std::shared_ptr<const Snapshot>>> bases;
  /// Agents whose poses may have changed since they were taken.
  std::set<int> changed;
};

/// `other_map` may be null: then no older revision can be read.
/// Errors: those of reading; what `stop` returned.
absl::StatusOr<TrackHistory> ReadTrackHistory(const MapContent& content, const KnownPairs& known,
                                              const Snapshot& other, MapReader* other_map,
                                              const StopCheck& stop);

/// Where the other map was put when it was merged before; nullopt if it was not, or has been
/// rebuilt since. Neither map is carried anywhere yet.
std::optional<Pose3d> TransformOfLastMerge(const MapContent& into, const MapContent& other);

}  // namespace dsg::merge
