// SPDX-License-Identifier: Apache-2.0
// What the tracks of copied agents were in the other map when they were copied.
// Refuses to guess where that cannot be read any more: such tracks go on, and are not corrected.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <vector>

#include "schema/merge/known_pairs.h"

namespace dsg::merge {

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

}  // namespace dsg::merge
