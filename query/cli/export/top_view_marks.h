// SPDX-License-Identifier: Apache-2.0
// The marks of a picture from above, and the legend that explains them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "query/cli/export/map_content.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

/// No mark of an agent reaches further from its middle, pixels of the canvas.
inline constexpr double kAgentMarkReachPx = 16.0;

/// The shape says the kind: a dot is a human, a square a robot, a diamond a vehicle, a triangle an
/// animal. The colour says which agent.
void DrawAgentMark(const std::string& kind, const Eigen::Vector2d& middle, uint32_t rgb,
                   picture::Canvas* canvas);

/// Counts of nodes by kind from the left margin to `x_end`, each behind the mark of its first node.
/// Kinds that the map does not have, and those without room, are left out.
void DrawLegend(const MapContent& content, const Eigen::Vector2d& low, double x_end,
                picture::Canvas* canvas);

}  // namespace dsg::cli
