// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/top_view_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "query/cli/table.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

constexpr double kLegendDotPx = 4.0;
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
    const Eigen::Vector2d half(1.3 * kMarkHalfPx, 0.0);
    canvas->DrawPolyline({middle - half, middle + half}, 2.0,
                         picture::MakePaint(LayerColor(layers::kPlaces), 0.5f));
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

void DrawLegend(const MapContent& content, const Eigen::Vector2d& low, double x_end,
                picture::Canvas* canvas) {
  constexpr std::array<const char*, 8> kKinds = {kinds::kRoom,    kinds::kStructure, kinds::kPlace,
                                                 kinds::kObject,  kinds::kRobot,     kinds::kHuman,
                                                 kinds::kVehicle, kinds::kAnimal};
  double x = low.x();
  for (const char* kind : kKinds) {
    const auto count = std::count_if(content.nodes.begin(), content.nodes.end(),
                                     [&](const Node& node) { return node.kind == kind; });
    if (count == 0) continue;
    const std::string text = Counted(count, kind);
    const double end = x + 40.0 + picture::Canvas::TextWidth(text, kLegendDotPx);
    if (end > x_end) continue;
    const double middle_y = low.y() + 0.5 * kLegendDotPx * picture::kCapHeightDots;
    DrawMarkOf(content, kind, {x + 14.0, middle_y}, canvas);
    canvas->DrawText({x + 40.0, low.y()}, text, kLegendDotPx, picture::MakePaint(kInkRgb));
    x = end + 44.0;
  }
}

}  // namespace dsg::cli
