// SPDX-License-Identifier: Apache-2.0
// When a point that moves along a line is within a distance of another point or of a box; exact.
// Refuses to know clocks and agents.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A straight move: start + fraction * step, fractions 0 to 1.
struct Move {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  /// Roots that miss 0 or 1 by no more than this count as met there.
  double fraction_slack = 0.0;

  Eigen::Vector3d At(double fraction) const { return start + fraction * step; }
};

/// Fractions of a move during which the distance is within the limit, and the closest of them.
struct NearSpan {
  double from = 0.0;
  double to = 0.0;
  double closest = 0.0;
  double distance_m = 0.0;
};

/// Distances that exceed a limit by no more than this, metres, still touch: rounding only.
inline constexpr double kTouchTolerance = 1e-9;

/// Near the origin: the roots of one quadratic. Nothing when the move stays farther than the limit.
std::optional<NearSpan> NearOrigin(const Move& move, double limit_m);

/// Near a box. The squared distance is a quadratic between the planes of the box's faces, of which
/// a move crosses six at most; distance to a convex body is convex along a line, so the span is
/// one. Requires: the box is not empty.
std::optional<NearSpan> NearBox(const Move& move, const Box3d& box, double limit_m);

}  // namespace dsg::ingest
