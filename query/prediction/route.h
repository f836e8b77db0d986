// SPDX-License-Identifier: Apache-2.0
// How someone gets from where they stand onto the graph, and from there to a goal.
// Refuses to know time and speed.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "query/prediction/prediction.h"

namespace dsg::query {

/// Torso and place of one storey differ by less than this.
inline constexpr double kStoreyHeightM = 1.5;

/// A way onto the graph: straight to `via_map`, then straight to the place.
struct Attachment {
  int place = 0;
  Eigen::Vector3d via_map = Eigen::Vector3d::Zero();
  double way_m = 0.0;
};

/// Every place whose clearance reaches over the position, and both ends of every link that passes
/// within `clearance_m_min` and its own clearance; failing these, the ends of the nearest link or
/// the nearest place within `attach_m_max`. Empty when there is nothing near. Distances are
/// horizontal: people's torsos and places have heights of their own.
std::vector<Attachment> Attach(const Eigen::Vector3d& position_map, const GoalField& field,
                               const GoalOptions& options);

/// A polyline from a person to a goal, at the person's height above the floor.
struct Route {
  std::vector<Eigen::Vector3d> points_map;
  /// Free radius around each point; 0 where nothing is known.
  std::vector<double> clearance_m;
  /// Way from the start to each point.
  std::vector<double> along_m;

  double length_m() const { return along_m.back(); }
  /// Clamped to the ends. `segment` is where to look first and what was found.
  Eigen::Vector3d At(double along, size_t* segment) const;
};

/// Along the attachment, then `places`, no further than `length_m_max` (and the rest of that link).
Route BuildRoute(const Eigen::Vector3d& position_map, const Attachment& attachment,
                 const std::vector<int>& places, const WalkGraph& graph, double length_m_max);

/// The same way with corners cut where `space` proves that free, with a point at least every
/// quarter of a metre.
Route Straightened(const Route& route, const FreeSpace& space, double margin_m);

}  // namespace dsg::query
