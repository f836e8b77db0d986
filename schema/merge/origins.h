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
/// For each of them: how many of the observations were taken from it, so that the next merge of
/// a later revision adds what is new and no more. "new:57" where the node came whole from there.
inline constexpr char kMergedCounts[] = "merged_counts";

struct Origin {
  std::string map;
  NodeId id;
  int64_t observation_count = 0;
  /// The node was copied from there, and not fused with one that this map had.
  bool is_copy = false;
};

/// Order: as written.
std::vector<Origin> OriginsOf(const Node& node);

/// `origin` is added, or replaces the one of the same map and id; which of them is a copy does not
/// change. Returns what had been counted from it before.
int64_t SetOrigin(Origin origin, Node* node);

/// The only origin of a node that was copied whole; nullopt for all others.
std::optional<Origin> CopiedFrom(const Node& node);

}  // namespace dsg::merge
