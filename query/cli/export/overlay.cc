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

void DrawShape(OverlayMark::Shape shape, const Eigen::Vector2d& middle, double r, uint32_t rgb,
               picture::Canvas* canvas) {
  if (shape == OverlayMark::Shape::kCross) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d arm(r, side * r);
      canvas->DrawPolyline({middle - arm, middle + arm}, 11.0, picture::MakePaint(kHaloRgb));
    }
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d arm(r, side * r);
      canvas->DrawPolyline({middle - arm, middle + arm}, 6.0, picture::MakePaint(rgb));
    }
    return;
  }
  canvas->FillCircle(middle, r + 4.0, picture::MakePaint(kHaloRgb));
  canvas->FillCircle(middle, r, picture::MakePaint(rgb));
  if (shape == OverlayMark::Shape::kRing) {
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
  std::erase_if(overlay->legend, [&](const OverlayKey& key) {
    const auto is_drawn = [&](const OverlayMark& mark) { return mark.shape == *key.shape; };
    return key.shape.has_value() && std::ranges::none_of(overlay->marks, is_drawn);
  });
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
    const Eigen::Vector2d middle = view.ToPixel(mark.position_map);
    DrawShape(mark.shape, middle, mark.radius_px, mark.rgb, canvas);
    layout->Block(Around(middle, mark.radius_px));
  }
}

void DrawOverlayLabels(const Overlay& overlay, const FloorView& view, picture::LabelLayout* layout,
                       picture::Canvas* canvas) {
  picture::LabelLayout over_lines(view.area_px());
  for (const OverlayMark& mark : overlay.marks) {
    over_lines.Block(Around(view.ToPixel(mark.position_map), mark.radius_px));
  }
  for (const OverlayMark& mark : overlay.marks) {
    if (mark.label.empty()) continue;
    const Label label{.text = mark.label, .dot_px = kAgentDotPx, .rgb = mark.rgb};
    const Eigen::AlignedBox2d thing = Around(view.ToPixel(mark.position_map), mark.radius_px + 6.0);
    std::optional<Eigen::AlignedBox2d> spot = WriteNameBeside(thing, label, layout, canvas);
    if (spot.has_value()) {
      over_lines.Block(*spot);
      continue;
    }
    spot = WriteNameBeside(thing, label, &over_lines, canvas);
    if (spot.has_value()) layout->Block(*spot);
  }
}

std::vector<LegendEntry> OverlayLegend(const Overlay& overlay) {
  constexpr double kSamplePx = 46.0;
  constexpr double kShapeRadiusPx = 9.0;
  std::vector<LegendEntry> entries;
  for (const OverlayKey& key : overlay.legend) {
    if (key.shape.has_value()) {
      entries.push_back(
          {.text = key.text, .draw = [key](const Eigen::Vector2d& middle, picture::Canvas* canvas) {
             DrawShape(*key.shape, middle, kShapeRadiusPx, key.rgb, canvas);
           }});
      continue;
    }
    entries.push_back({.text = key.text,
                       .mark_px = kSamplePx,
                       .draw = [key](const Eigen::Vector2d& middle, picture::Canvas* canvas) {
                         const Eigen::Vector2d half(20.0, 0.0);
                         canvas->DrawPolyline({middle - half, middle + half}, key.width_px,
                                              picture::MakePaint(key.rgb));
                       }});
  }
  return entries;
}

}  // namespace dsg::cli
