// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/overlay.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "query/cli/export/top_view_labels.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"
#include "schema/picture/font.h"

namespace dsg::cli {
namespace {

constexpr double kKeyDotPx = 4.0;
constexpr uint32_t kKeyInkRgb = 0x2b2f3a;
constexpr uint32_t kHaloRgb = 0xffffff;

Eigen::AlignedBox2d Around(const Eigen::Vector2d& middle, double reach_px) {
  const Eigen::Vector2d reach(reach_px, reach_px);
  return Eigen::AlignedBox2d(middle - reach, middle + reach);
}

void DrawLine(const OverlayLine& line, const FloorView& view, picture::Canvas* canvas) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Eigen::Vector3d& point : line.points_map) pixels.push_back(view.ToPixel(point));
  canvas->DrawPolyline(pixels, line.width_px + 5.0,
                       picture::MakePaint(kHaloRgb, 0.8f * line.opacity));
  canvas->DrawPolyline(pixels, line.width_px, picture::MakePaint(line.rgb, line.opacity));
}

void DrawMark(const OverlayMark& mark, const FloorView& view, picture::Canvas* canvas) {
  const Eigen::Vector2d middle = view.ToPixel(mark.position_map);
  const double r = mark.radius_px;
  if (mark.shape == OverlayMark::Shape::kCross) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d arm(r, side * r);
      canvas->DrawPolyline({middle - arm, middle + arm}, 11.0, picture::MakePaint(kHaloRgb));
    }
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d arm(r, side * r);
      canvas->DrawPolyline({middle - arm, middle + arm}, 6.0, picture::MakePaint(mark.rgb));
    }
    return;
  }
  canvas->FillCircle(middle, r + 4.0, picture::MakePaint(kHaloRgb));
  canvas->FillCircle(middle, r, picture::MakePaint(mark.rgb));
  if (mark.shape == OverlayMark::Shape::kRing) {
    canvas->FillCircle(middle, 0.55 * r, picture::MakePaint(kHaloRgb));
  }
}

// Names keep clear of the whole line, not only of its corners.
void BlockLine(const OverlayLine& line, const FloorView& view, picture::LabelLayout* layout) {
  constexpr double kStepPx = 16.0;
  for (size_t i = 1; i < line.points_map.size(); ++i) {
    const Eigen::Vector2d from = view.ToPixel(line.points_map[i - 1]);
    const Eigen::Vector2d to = view.ToPixel(line.points_map[i]);
    const int step_count = std::max(1, static_cast<int>((to - from).norm() / kStepPx));
    for (int step = 0; step <= step_count; ++step) {
      const double part = static_cast<double>(step) / step_count;
      layout->Block(Around(from + part * (to - from), 0.5 * line.width_px + 2.0));
    }
  }
}

}  // namespace

void KeepFloor(const HeightRange& floor, Overlay* overlay) {
  const HeightRange heights = StandingHeights(floor);
  std::vector<OverlayLine> lines;
  for (const OverlayLine& line : overlay->lines) {
    for (std::vector<Eigen::Vector3d>& piece : PiecesOnFloor(floor, line.points_map)) {
      OverlayLine& kept = lines.emplace_back(line);
      kept.points_map = std::move(piece);
    }
  }
  overlay->lines = std::move(lines);
  std::erase_if(overlay->marks,
                [&](const OverlayMark& mark) { return !heights.Contains(mark.position_map.z()); });
  std::erase_if(overlay->outlines,
                [&](const OverlayOutline& outline) { return !heights.Contains(outline.height_m); });
}

Eigen::AlignedBox2d BoundsOf(const Overlay& overlay) {
  Eigen::AlignedBox2d bounds;
  for (const OverlayOutline& outline : overlay.outlines) {
    for (const Eigen::Vector2d& corner : outline.corners_map) bounds.extend(corner);
  }
  for (const OverlayLine& line : overlay.lines) {
    for (const Eigen::Vector3d& p : line.points_map) bounds.extend(Eigen::Vector2d(p.head<2>()));
  }
  for (const OverlayMark& mark : overlay.marks) {
    bounds.extend(Eigen::Vector2d(mark.position_map.head<2>()));
  }
  return bounds;
}

void DrawOverlay(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                 picture::Canvas* canvas) {
  for (const OverlayOutline& outline : overlay.outlines) {
    const Polygon2d pixels = view.ToPixels(outline.corners_map);
    canvas->FillPolygon(pixels, picture::MakePaint(outline.rgb, outline.opacity));
    canvas->DrawOutline(pixels, outline.width_px, picture::MakePaint(outline.rgb));
  }
  for (const OverlayLine& line : overlay.lines) {
    DrawLine(line, view, canvas);
    BlockLine(line, view, layout);
  }
  for (const OverlayMark& mark : overlay.marks) {
    DrawMark(mark, view, canvas);
    layout->Block(Around(view.ToPixel(mark.position_map), mark.radius_px));
  }
}

void DrawOverlayLabels(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                       picture::Canvas* canvas) {
  for (const OverlayMark& mark : overlay.marks) {
    if (mark.label.empty()) continue;
    const Eigen::AlignedBox2d thing = Around(view.ToPixel(mark.position_map), mark.radius_px + 6.0);
    WriteNameBeside(thing, mark.label, mark.rgb, layout, canvas);
  }
}

void DrawOverlayLegend(const Overlay& overlay, const Eigen::Vector2d& low, double x_end,
                       picture::Canvas* canvas) {
  constexpr double kSamplePx = 44.0;
  const double middle_y = low.y() + 0.5 * kKeyDotPx * picture::kCapHeightDots;
  double x = low.x();
  for (const OverlayKey& key : overlay.legend) {
    const double end = x + kSamplePx + 14.0 + picture::Canvas::TextWidth(key.text, kKeyDotPx);
    if (end > x_end) return;
    canvas->DrawPolyline({{x + 4.0, middle_y}, {x + kSamplePx, middle_y}}, key.width_px,
                         picture::MakePaint(key.rgb));
    canvas->DrawText({x + kSamplePx + 14.0, low.y()}, key.text, kKeyDotPx,
                     picture::MakePaint(kKeyInkRgb));
    x = end + 44.0;
  }
}

}  // namespace dsg::cli
