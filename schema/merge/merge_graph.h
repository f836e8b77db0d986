// SPDX-License-Identifier: Apache-2.0
// The nodes and edges that a merge writes: new, fused, closed. Takes pairs and changes as given.
#pragma once

#include <vector>

#include "schema/merge/merge.h"
#include "schema/merge/origins.h"

namespace dsg::merge {

/// The findings about two maps. The referenced objects must outlive this.
struct Findings {
  /// By node of the other map; see MatchNodes.
  const std::vector<int>& pair_of;
  const KnownPairs& known;
  const SessionChanges& changes;
  const TrackHistory& tracks;
};

/// Fills ids, counts, gone, moved and graph of `plan`.
/// Requires: `other` is adopted (see Adopt).
/// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED when no unused id is left.
absl::Status BuildGraph(const MapContent& into, const MapContent& other, const Findings& findings,
                        const MergeOptions& options, MergePlan* plan);

}  // namespace dsg::merge
