// SPDX-License-Identifier: Apache-2.0
// Keeps the ids of places while the map grows, and tells which place is nearest and in sight.
#pragma once

#include <optional>
#include <vector>

#include "ingest/grid/distance_field.h"
#include "ingest/places/place_graph.h"
#include "ingest/places/place_options.h"
#include "ingest/trajectory/trajectory_change.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class PlaceTracker {
 public:
  explicit PlaceTracker(double same_m = PlaceOptions().same_m) : same_m_(same_m) {}

  /// Gives `graph` the ids of the last one's places where they are near, and new ones otherwise;
  /// sorts it by id. Ids are never given twice.
  void Track(PlaceGraph* graph);

  /// The map has moved under the last graph.
  void Move(const PointMove& move);

 private:
  double same_m_;
  PlaceGraph last_;
  int64_t next_id_ = 0;
};

/// Index of the nearest place that is in straight sight, of the nearest few; failing that, of the
/// nearest that no wall hides above the furniture; failing that, of the nearest. -1 without places
/// or for a point that is not finite. `field`: of the volume, not of a floor.
/// Source: RSS 2020, section IV-B, with line of sight added: a person behind a wall is not here.
int NearestPlaceInSight(const PlaceGraph& graph, const DistanceField& field,
                        const Eigen::Vector3d& point_map, const PlaceOptions& options);

/// Whether a place is in straight sight of a point; of one on the floor, the body that stands
/// there.
bool IsPlaceInSight(const Eigen::Vector3d& place_map, bool is_on_floor, const DistanceField& field,
                    const Eigen::Vector3d& point_map, const PlaceOptions& options);

}  // namespace dsg::ingest
