// SPDX-License-Identifier: Apache-2.0
// Where people can walk around a spot and what draws them there: the places of a map as predictions
// want them. Everybody in a tile gets the same area.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "query/prediction/goal_prediction.h"
#include "query/view/graph_view.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// A square of the floor plan with the places around it.
struct WalkTile {
  /// As many metres wide as kTileM, and as high as a storey or so.
  static constexpr double kTileM = 20.0;

  int64_t x = 0;
  int64_t y = 0;
  int64_t z = 0;
  /// Places up to here beside the tile belong.
  double reach_m = 0.0;

  bool operator==(const WalkTile&) const = default;
  /// What holds them.
  Box3d BoxMap() const;
};

/// The tile of a position. Any finite position; beyond a billion metres tiles are the last ones.
WalkTile TileOf(const Eigen::Vector3d& position_map, double reach_m);

/// The places alone, at one instant.
struct WalkGrounds {
  /// Without goals.
  GoalField field;
  /// Of the places of `field`.
  std::vector<PlaceIndex> places;
  /// While all of this is the same.
  Interval valid;
};

/// Places and goals.
struct WalkArea {
  GoalField field;
  /// The node that stands for each goal of `field`.
  std::vector<NodeId> goal_nodes;
  /// While all of this is the same.
  Interval valid;

  size_t memory_bytes() const;
};

/// Errors: what `stop` returned.
absl::StatusOr<WalkGrounds> MakeWalkGrounds(const PlaceGraph& all, const WalkTile& tile,
                                            TimeNs at_ns, const StopCheck& stop);

/// The places of a tile as they are at one instant, without links.
/// Errors: what `stop` returned.
absl::StatusOr<WalkGraph> PlacesOfTile(const PlaceGraph& all, const WalkTile& tile, TimeNs at_ns,
                                       const StopCheck& stop);

/// Goals are where rooms meet, what people sit at or use, ways out of the building, and a place
/// here and there. Requires: `grounds` of the same tile, valid at `at_ns`; `all` is
/// `view.Places()`. Errors: what `stop` returned.
absl::StatusOr<WalkArea> MakeWalkArea(const GraphView& view, const PlaceGraph& all,
                                      const WalkGrounds& grounds, const WalkTile& tile,
                                      TimeNs at_ns, const StopCheck& stop);

/// The walk areas that predictions used last, under a bound of memory. Keeps no graph alive: areas
/// of graphs that are gone go too.
///
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
