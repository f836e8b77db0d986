// SPDX-License-Identifier: Apache-2.0
// Whether a graph of places can be walked, reaches everywhere and makes no detours.
// Refuses to judge heights: it looks from above, on the true free grid.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "ingest/evaluation/grid_map.h"

namespace dsg::evaluation {

struct EstimatedPlace {
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  double clearance_m = 0.0;
};

/// Indices of places.
using PlaceEdge = std::pair<int, int>;

struct PlaceOptions {
  /// Less one cell of the grid, whose edges are only that sharp.
  double robot_radius_m = 0.25;
  double coverage_step_m = 0.5;
  double coverage_clearance_m = 0.3;
  /// A place covers no further than this.
  double reach_m = 3.0;
  /// Ways enter and leave the graph at places this near or, failing that, at the nearest one in
  /// reach: a long straight first step would hide the graph's detours.
  double enter_m = 1.0;
  int start_count = 20;
  int goals_per_start = 10;
  double way_m_min = 2.0;
  uint64_t seed = 1;
};

/// Shares from 0 to 1.
struct PlaceResult {
  /// Of the edges, each counted once: no place on the straight line nearer to an obstacle than the
  /// robot's radius.
  std::optional<double> collision_free_ratio;
  /// Of points every half metre of the observed free space: a place is in straight-line reach.
  std::optional<double> coverage;
  /// Median over random pairs of points of (way over places) / (shortest way on the grid). Edges
  /// that collide are not walked; pairs without a way count as infinite. nullopt when that is the
  /// median.
  std::optional<double> stretch_median;
  /// Share of those pairs that have a way over places; all of them have one on the grid.
  std::optional<double> connectivity;
  std::optional<double> per_100_m2;
  int64_t place_count = 0;
  int64_t edge_count = 0;
  int64_t pair_count = 0;
};

/// Source: RSS 2020, section IV-B (places); what is measured of them is ours.
PlaceResult EvaluatePlaces(const std::vector<EstimatedPlace>& places,
                           const std::vector<PlaceEdge>& edges, const GridMap& map,
                           const PlaceOptions& options);

}  // namespace dsg::evaluation
