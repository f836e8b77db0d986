// SPDX-License-Identifier: Apache-2.0
// The frame of a map that is seen from above: the axes of the map frame with ticks in metres.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "query/cli/export/outline.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// Pixels that labels take at the left of the map and below it.
inline constexpr double kAxisLeftPx = 96.0;
inline constexpr double kAxisBottomPx = 56.0;

/// The largest of 1, 2 and 5 times a power of ten that is not above `length`. Requires: above zero.
double RoundBelow(double length);

/// The multiples of a round step in [low, high], metres, at least `apart_min` from each other;
/// ascending. Requires: low <= high, apart_min above zero.
std::vector<double> TicksOf(double low, double high, double apart_min);

/// A frame around the map, ticks outside of it, their metres, and the names of the axes.
void DrawAxes(const FloorView& view, picture::Canvas* canvas);

}  // namespace dsg::cli
