// SPDX-License-Identifier: Apache-2.0
// What an answer adds to a picture of a map: ways, marks and outlines, and what they stand for.
// Refuses to know the question.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "schema/model/geometry.h"
#include "schema/model/ids.h"

namespace dsg::cli {

// Colours are 0xRRGGBB; map frame throughout; pixels of a picture twice as wide as asked for.

struct OverlayLine {
  std::vector<Eigen::Vector3d> points_map;
  uint32_t rgb = 0;
  double width_px = 7.0;
  float opacity = 0.9f;
};

struct OverlayMark {
  enum class Shape { kDot, kRing, kCross };
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  uint32_t rgb = 0;
  Shape shape = Shape::kDot;
  double radius_px = 14.0;
  /// Written beside the mark if there is room.
  std::string label;
};

struct OverlayOutline {
  Polygon2d corners_map;
  uint32_t rgb = 0;
  /// Which floor it belongs to, metres.
  double height_m = 0.0;
};

struct OverlayKey {
  std::string text;
  uint32_t rgb = 0;
};

/// Later ones of a list are drawn over earlier ones; marks over lines over outlines.
struct Overlay {
  std::vector<OverlayOutline> outlines;
  std::vector<OverlayLine> lines;
  std::vector<OverlayMark> marks;
  std::vector<OverlayKey> legend;
  /// Nodes that marks name: the map does not name them again.
  std::set<NodeId> named;

  bool empty() const {
    return outlines.empty() && lines.empty() && marks.empty() && legend.empty();
  }
};

}  // namespace dsg::cli
