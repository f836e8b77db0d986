// SPDX-License-Identifier: Apache-2.0
// The outlines of nodes: corners of their boxes in space, and their shapes on the floor.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "schema/model/node.h"

namespace dsg::cli {

/// Map frame; bit i of the index chooses the upper end of axis i of the node's frame.
/// Requires: the box is not empty.
std::array<Eigen::Vector3d, 8> BoxCorners(const Node& node);

/// Lines in space.
struct Wire {
  std::vector<Eigen::Vector3d> points;
  /// Indices into `points`.
  std::vector<std::array<uint32_t, 2>> lines;
};

/// The edges of the node's box, or of the prism over a region's footprint; no lines without either.
/// Frames: map.
Wire WireOf(const Node& node);

/// The convex hull, counter-clockwise; fewer corners when the points lie on a line.
Polygon2d ConvexHull(Polygon2d points);

/// Seen from above: the footprint of a region, otherwise the box; empty without either.
Polygon2d FloorOutline(const Node& node);

/// Without sign, whichever way the corners go.
double AreaOf(const Polygon2d& polygon);

}  // namespace dsg::cli
