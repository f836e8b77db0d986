// SPDX-License-Identifier: Apache-2.0
// Where a node of a merged map came from, kept as attributes of the node.
// Refuses to guess: a text that this did not write is no origin.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/node.h"

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

}  // namespace dsg::merge
