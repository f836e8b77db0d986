// SPDX-License-Identifier: Apache-2.0
// The marks of a picture from above, and the legend that explains them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "query/cli/export/map_content.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// No mark of an agent reaches further from its middle, pixels of the canvas.
inline constexpr double kAgentMarkReachPx = 16.0;

/// The shape says the kind: a dot is a human, a square a robot, a diamond a vehicle, a triangle an
/// animal. The colour says which agent.
void DrawAgentMark(const std::string& kind, const Eigen::Vector2d& middle, uint32_t rgb,
                   picture::Canvas* canvas);

/// One mark of a picture and what it says.
struct LegendEntry {
  std::string text;
  /// Width of the mark, pixels of the canvas.
  double mark_px = 28.0;
  std::function<void(const Eigen::Vector2d& middle, picture::Canvas* canvas)> draw;
};

/// Counts of nodes by kind, each behind the mark of its first node, and the lines between rooms and
/// between places. What the map does not have is left out. Points into `content`.
std::vector<LegendEntry> MapLegend(const MapContent& content);

/// Height of a row of a legend, pixels of the canvas.
inline constexpr double kLegendRowPx = 52.0;

/// Where a legend may stand, pixels of the canvas.
struct LegendSpace {
  /// Of the first row, which may have something at its right.
  double first_width_px = 0.0;
  double width_px = 0.0;
  int row_count_max = 1;
};

/// At most a quarter of a picture's width is the height of a legend, but it has a row at least.
int LegendRowsMax(int width_px);

/// Entries one behind the other in as many rows as they take; those without space are left out.
class LegendRows {
 public:
  LegendRows(std::vector<LegendEntry> entries, const LegendSpace& space);

  double height_px() const { return kLegendRowPx * row_count_; }
  /// `low`: the top left corner of the first row's letters.
  void Draw(const Eigen::Vector2d& low, picture::Canvas* canvas) const;

 private:
  struct Placed {
    LegendEntry entry;
    Eigen::Vector2d low;
  };
  std::vector<Placed> placed_;
  int row_count_ = 0;
};

}  // namespace dsg::cli
