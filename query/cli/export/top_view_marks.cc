// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/top_view_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "query/cli/table.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

constexpr double kLegendDotPx = 4.0;
// Between a mark and its text, and between entries.
constexpr double kLegendGapPx = 12.0;
constexpr double kLegendApartPx = 44.0;
constexpr double kMarkHalfPx = 11.0;
constexpr uint32_t kRimRgb = 0xffffff;

std::vector<Eigen::Vector2d> RegularPolygon(const Eigen::Vector2d& middle, int corner_count,
                                            double radius, double first_rad) {
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < corner_count; ++i) {
    const double angle_rad = first_rad + 2.0 * std::numbers::pi * i / corner_count;
    corners.push_back(middle + radius * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
  }
  return corners;
}

std::vector<Eigen::Vector2d> Square(const Eigen::Vector2d& middle, double half_px) {
  return RegularPolygon(middle, 4, half_px * std::numbers::sqrt2, 0.25 * std::numbers::pi);
}

// The first node of a kind, and its place among the tracks if it has one, which says its colour.
struct FirstOfKind {
  const Node* node = nullptr;
  size_t track_index = 0;
  bool has_track = false;
};

FirstOfKind FindFirst(const MapContent& content, const std::string& kind) {
  FirstOfKind first;
  const auto nodes = NodesById(content);
  for (size_t i = 0; i < content.tracks.size(); ++i) {
    const auto node = nodes.find(content.tracks[i].agent);
    if (node != nodes.end() && node->second->kind == kind) return {node->second, i, true};
  }
  const auto found = std::find_if(content.nodes.begin(), content.nodes.end(),
                                  [&](const Node& node) { return node.kind == kind; });
  if (found != content.nodes.end()) first.node = &*found;
  return first;
}

// As DrawTopView draws a node of the kind, of one size.
void DrawMarkOf(const MapContent& content, const std::string& kind, const Eigen::Vector2d& middle,
                picture::Canvas* canvas) {
  const FirstOfKind first = FindFirst(content, kind);
  if (first.node == nullptr) return;
  const std::vector<Eigen::Vector2d> square = Square(middle, kMarkHalfPx);
  if (kind == kinds::kRoom) {
    canvas->FillPolygon(square, picture::MakePaint(FloorColor(*first.node), 0.8f));
    canvas->DrawOutline(square, 2.0, picture::MakePaint(kWallRgb, 0.35f));
  } else if (kind == kinds::kStructure) {
    const Eigen::Vector2d half(kMarkHalfPx, 0.4 * kMarkHalfPx);
    canvas->FillRect(middle - half, middle + half, picture::MakePaint(kWallRgb));
  } else if (kind == kinds::kPlace) {
    canvas->FillCircle(middle, 6.0,
                       picture::MakePaint(PlaceColor(*first.node, ParentsOf(content))));
  } else if (kind == kinds::kObject) {
    canvas->FillPolygon(square, picture::MakePaint(ClassColor(*first.node), 0.6f));
    canvas->DrawOutline(square, 2.5, picture::MakePaint(ClassColor(*first.node), 0.7f));
  } else {
    DrawAgentMark(kind, middle,
                  first.has_track ? AgentColor(first.track_index) : LayerColor(layers::kAgents),
                  canvas);
  }
}

bool HasRelation(const MapContent& content, const char* relation) {
  return std::any_of(content.edges.begin(), content.edges.end(),
                     [&](const Edge& edge) { return edge.relation == relation; });
}

// A sample of a line.
LegendEntry LineEntry(const std::string& text, double width_px, const picture::Paint& paint) {
  return {.text = text, .draw = [=](const Eigen::Vector2d& middle, picture::Canvas* canvas) {
            const Eigen::Vector2d half(1.3 * kMarkHalfPx, 0.0);
            canvas->DrawPolyline({middle - half, middle + half}, width_px, paint);
          }};
}

}  // namespace

void DrawAgentMark(const std::string& kind, const Eigen::Vector2d& middle, uint32_t rgb,
                   picture::Canvas* canvas) {
  constexpr double kUp = -0.5 * std::numbers::pi;
  const auto draw = [&](const auto& shape_of) {
    canvas->FillPolygon(shape_of(kAgentMarkReachPx), picture::MakePaint(kRimRgb));
    canvas->FillPolygon(shape_of(kAgentMarkReachPx - 4.0), picture::MakePaint(rgb));
  };
  if (kind == kinds::kRobot) {
    draw([&](double reach) { return Square(middle, 0.8 * reach); });
  } else if (kind == kinds::kVehicle) {
    draw([&](double reach) { return RegularPolygon(middle, 4, reach, kUp); });
  } else if (kind == kinds::kAnimal) {
    draw([&](double reach) { return RegularPolygon(middle, 3, reach, kUp); });
  } else {
    canvas->FillCircle(middle, 14.0, picture::MakePaint(kRimRgb));
    canvas->FillCircle(middle, 11.0, picture::MakePaint(rgb));
  }
}

std::vector<LegendEntry> MapLegend(const MapContent& content) {
  constexpr std::array<const char*, 8> kKinds = {kinds::kRoom,    kinds::kStructure, kinds::kPlace,
                                                 kinds::kObject,  kinds::kRobot,     kinds::kHuman,
                                                 kinds::kVehicle, kinds::kAnimal};
  std::vector<LegendEntry> entries;
  for (const char* kind : kKinds) {
    const auto count = std::count_if(content.nodes.begin(), content.nodes.end(),
                                     [&](const Node& node) { return node.kind == kind; });
    if (count == 0) continue;
    entries.push_back(
        {.text = Counted(count, kind),
         .draw = [&content, kind](const Eigen::Vector2d& middle, picture::Canvas* canvas) {
           DrawMarkOf(content, kind, middle, canvas);
         }});
  }
  if (HasRelation(content, relations::kAdjacent)) {
    entries.push_back(LineEntry("neighbouring rooms", 4.0, picture::MakePaint(kRoomLinkRgb, 0.5f)));
  }
  if (HasRelation(content, relations::kTraversable)) {
    entries.push_back(LineEntry("ways between places", 2.0,
                                picture::MakePaint(LayerColor(layers::kPlaces), 0.5f)));
  }
  return entries;
}

int LegendRowsMax(int width_px) {
  // Of the canvas, which is twice the size of the picture.
  return std::max(1, static_cast<int>(0.25 * 2.0 * width_px / kLegendRowPx));
}

LegendRows::LegendRows(std::vector<LegendEntry> entries, const LegendSpace& space) {
  int row = 0;
  double x = 0.0;
  for (LegendEntry& entry : entries) {
    const double width =
        entry.mark_px + kLegendGapPx + picture::Canvas::TextWidth(entry.text, kLegendDotPx);
    if (width > space.width_px) continue;
    if (x + width > (row == 0 ? space.first_width_px : space.width_px)) {
      // A shorter one may still fit into the last row.
      if (row + 1 >= space.row_count_max) continue;
      ++row;
      x = 0.0;
    }
    placed_.push_back({std::move(entry), Eigen::Vector2d(x, kLegendRowPx * row)});
    x += width + kLegendApartPx;
    row_count_ = row + 1;
  }
}

void LegendRows::Draw(const Eigen::Vector2d& low, picture::Canvas* canvas) const {
  const double half_letter_px = 0.5 * kLegendDotPx * picture::kCapHeightDots;
  for (const Placed& placed : placed_) {
    const Eigen::Vector2d at = low + placed.low;
    const double mark_px = placed.entry.mark_px;
    placed.entry.draw(at + Eigen::Vector2d(0.5 * mark_px, half_letter_px), canvas);
    canvas->DrawText(at + Eigen::Vector2d(mark_px + kLegendGapPx, 0.0), placed.entry.text,
                     kLegendDotPx, picture::MakePaint(kInkRgb));
  }
}

}  // namespace dsg::cli
