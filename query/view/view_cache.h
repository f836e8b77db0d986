// SPDX-License-Identifier: Apache-2.0
// The views that questions have asked for, of all maps, under a bound of memory. A view that is
// missing is derived from the nearest one of its map, or read whole; whoever asks for it meanwhile
// waits for that, within its own deadline. What planning adds to a view's places later is counted
// at the next question to that view.
#pragma once

#include <cstddef>
#include <memory>

#include "absl/status/statusor.h"
#include "query/view/graph_view.h"

namespace dsg::query {

/// Threads: safe from many threads.
class ViewCache {
 public:
  explicit ViewCache(size_t bytes_max);
  ~ViewCache();

  /// The view of `snapshot`, which must be of `map`.
  /// Errors: as GraphView::Load; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED when the view alone is larger
  /// than the bound.
  absl::StatusOr<std::shared_ptr<const GraphView>> Get(
      const std::shared_ptr<MapReader>& map, const std::shared_ptr<const Snapshot>& snapshot,
      const StopCheck& stop);

  struct Stats {
    size_t bytes = 0;
    int64_t view_count = 0;
    int64_t hit_count = 0;
    int64_t derived_count = 0;
    int64_t loaded_count = 0;
  };
  Stats stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::query
