// SPDX-License-Identifier: Apache-2.0
// Openings of walls, seen from above: where ways between places lead through them. A wall that
// perception found is one plane, whatever doors are in it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <vector>

#include "query/cli/export/map_content.h"

namespace dsg::cli {

/// A wall, or a piece of one, seen from above. Map frame, metres.
struct WallLine {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  /// 0 of a plane.
  double thickness_m = 0.0;
};

/// What is left of walls between the places that ways cross them at. An opening is as wide as the
/// way is clear there (the weight of its edge, to both sides), within 0.5 to 1.2 m.
class Openings {
 public:
  /// Keeps nothing of `content`.
  explicit Openings(const MapContent& content);

  /// nullopt if no way leads through the wall, or it has no line: it is whole then.
  std::optional<std::vector<WallLine>> PiecesOf(const Node& wall) const;

 private:
  struct Way {
    Eigen::Vector2d from;
    Eigen::Vector2d to;
    double height_m = 0.0;
    double clear_m = 0.0;

    double low_x() const { return std::min(from.x(), to.x()); }
  };

  // Ascending by low_x.
  std::vector<Way> ways_;
  // Of all ways along x.
  double reach_m_ = 0.0;
};

}  // namespace dsg::cli
