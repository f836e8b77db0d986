// SPDX-License-Identifier: Apache-2.0
// The nodes and edges that a merge writes: new, fused, closed. Takes pairs and changes as given.
#pragma once

#include <vector>

#include "schema/merge/merge.h"
#include "schema/merge/origins.h"

namespace dsg::merge {

/// What has been found out about two maps. All refers to what outlives it.
struct Findings {
  /// By node of the other map: as MatchNodes.
  const std::vector<int>& pair_of;
  const KnownPairs& known;
  const SessionChanges& changes;
  const TrackHistory& tracks;
};

/// Fills ids, counts, gone, moved and graph of `plan`. `other` is adopted already.
/// Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED when there is no id above all that were used.
absl::Status BuildGraph(const MapContent& into, const MapContent& other, const Findings& findings,
                        const MergeOptions& options, MergePlan* plan);

}  // namespace dsg::merge
