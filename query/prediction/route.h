// SPDX-License-Identifier: Apache-2.0
// How someone gets from where they stand onto the graph and to a goal, how fast they walk on, and
// where along the route they are at which time.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "query/prediction/goal_prediction.h"

namespace dsg::query {

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

/// Who slows down comes to rest; who sets out reaches the pace of a walk.
///
/// A speed that changes evenly until it is `end_m_s`, and stays so.
struct Pace {
  double speed_m_s = 0.0;
  double end_m_s = 0.0;
  /// Not negative; 0 = the speed stays as it is.
  double change_m_s2 = 0.0;

  double SpeedAt(double seconds) const;
  /// Walked after `seconds`.
  double WayM(double seconds) const;
  double peak_m_s() const { return speed_m_s > end_m_s ? speed_m_s : end_m_s; }
};

/// Even, at `speed_m_s`, unless the last three steps tell of a change. Steps that turn tell
/// nothing: around a corner they look short.
Pace PaceOf(const std::vector<PathPoint>& path, double speed_m_s, const GoalOptions& options);

/// Positions after `seconds` (ascending, from 0 on), setting out in the direction `heading_map`, a
/// unit vector.
/// Source: Coulter 1992 (pure pursuit).
std::vector<Eigen::Vector3d> WalkRoute(const Route& route, const Eigen::Vector3d& heading_map,
                                       const Pace& pace, const std::vector<double>& seconds,
                                       const GoalOptions& options);

}  // namespace dsg::query
