// SPDX-License-Identifier: Apache-2.0
// Nodes of two maps that an earlier merge has made one, told from their origins.
// Refuses names alone: a map that was made anew under an old name is another map.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"
#include "schema/merge/origins.h"
#include "schema/store/graph_store.h"

namespace dsg::merge {

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

}  // namespace dsg::merge
