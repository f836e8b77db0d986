// SPDX-License-Identifier: Apache-2.0
// The walk areas that predictions asked for last, under a bound of memory.
// Refuses to keep a graph alive: areas of graphs that are gone go too.
#pragma once

#include <list>
#include <memory>
#include <mutex>

#include "query/engine/walk_area.h"

namespace dsg::query {

/// Threads: safe from many threads; areas are made outside the lock, so two that ask for the same
/// one at once may both make it.
class WalkAreaCache {
 public:
  explicit WalkAreaCache(size_t bytes_max = size_t{64} << 20) : bytes_max_(bytes_max) {}

  /// The area of the tile of a position at an instant; the same whether or not it was kept.
  /// Errors: what `stop` returned; nothing is kept of what was half made.
  /// Cost: when it is not kept, a look at every place of the map.
  absl::StatusOr<std::shared_ptr<const WalkArea>> Get(const std::shared_ptr<const GraphView>& view,
                                                      const Eigen::Vector3d& position_map,
                                                      double reach_m, TimeNs at_ns,
                                                      const StopCheck& stop);

  struct Stats {
    size_t bytes = 0;
    int64_t area_count = 0;
    int64_t hit_count = 0;
    int64_t made_count = 0;
    /// Made of places that another revision's area had.
    int64_t shared_count = 0;
  };
  Stats stats() const;

 private:
  struct Entry {
    std::weak_ptr<const GraphView> view;
    std::weak_ptr<const PlaceGraph> places;
    WalkTile tile;
    std::shared_ptr<const WalkGrounds> grounds;
    std::shared_ptr<const WalkArea> area;
    size_t bytes = 0;
  };

  std::shared_ptr<const WalkArea> FindArea(const std::shared_ptr<const GraphView>& view,
                                           const WalkTile& tile, TimeNs at_ns);
  std::shared_ptr<const WalkGrounds> FindGrounds(const std::shared_ptr<const PlaceGraph>& places,
                                                 const WalkTile& tile, TimeNs at_ns) const;
  void Insert(Entry entry);

  const size_t bytes_max_;
  mutable std::mutex mutex_;
  // The one that was asked for last comes first.
  std::list<Entry> entries_;
  Stats stats_;
};

}  // namespace dsg::query
