// SPDX-License-Identifier: Apache-2.0
// What an answer adds to a picture of a map: paths, marks and outlines, and a legend. The map below
// is paled, and no name covers a path.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "query/cli/export/map_content.h"
#include "query/cli/export/outline.h"
#include "query/cli/export/top_view_marks.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"
#include "schema/picture/font.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

// Colours are 0xRRGGBB; positions are in the map frame, metres; pixels are those of a picture twice
// as wide as asked for.

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
  /// Written beside the mark if there is space.
  std::string label;
};

struct OverlayOutline {
  Polygon2d corners_map;
  uint32_t rgb = 0;
  /// Height that decides its floor, metres.
  double height_m = 0.0;
  double width_px = 5.0;
  /// Of what is inside.
  float opacity = 0.3f;
};

struct OverlayKey {
  std::string text;
  uint32_t rgb = 0;
  double width_px = 9.0;
  /// The mark that it explains; unset = a line or an outline.
  std::optional<OverlayMark::Shape> shape{};
};

/// Later entries of a list are drawn over earlier ones; marks over lines over outlines.
struct Overlay {
  std::vector<OverlayOutline> outlines;
  std::vector<OverlayLine> lines;
  std::vector<OverlayMark> marks;
  std::vector<OverlayKey> legend;
  /// Nodes that marks name; the map does not name them again.
  std::set<NodeId> named;

  bool empty() const {
    return outlines.empty() && lines.empty() && marks.empty() && legend.empty();
  }
};

/// Keeps what lies within StandingHeights of the floor; lines are cut where they leave it. Shapes
/// of which no mark is left are not in the legend either.
void KeepFloor(const HeightRange& floor, Overlay* overlay);

/// Bounds of all that is drawn, seen from above; empty without content.
Eigen::AlignedBox2d BoundsOf(const Overlay& overlay);

/// Lines, outlines and marks, without their labels; reserves their space in `layout`.
void DrawOverlay(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                 picture::Canvas* canvas);

/// Labels of the marks, in their order; call before writing other names. One that finds no space
/// may cover lines, and one without any space is left out.
void DrawOverlayLabels(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                       picture::Canvas* canvas);

std::vector<LegendEntry> OverlayLegend(const Overlay& overlay);

}  // namespace dsg::cli
