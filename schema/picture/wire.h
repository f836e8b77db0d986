// SPDX-License-Identifier: Apache-2.0
// Nodes as lines in space: boxes, and prisms over the outlines of regions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "schema/model/node.h"

namespace dsg {

/// Map frame; bit i of the index chooses the upper end of axis i of the node's frame.
/// Requires: the box is not empty.
std::array<Eigen::Vector3d, 8> BoxCorners(const Node& node);

/// Lines in space, map frame, metres.
struct Wire {
  std::vector<Eigen::Vector3d> points;
  /// Indices into `points`.
  std::vector<std::array<uint32_t, 2>> lines;
};

/// The edges of the node's box, or of the prism over a region's footprint; no lines without either.
/// Frames: map.
Wire WireOf(const Node& node);

}  // namespace dsg
