// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/top_view_labels.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "query/cli/export/outline.h"
#include "query/cli/export/palette.h"
#include "schema/picture/font.h"

namespace dsg::cli {
namespace {

using Box2d = Eigen::AlignedBox2d;
using picture::Canvas;
using picture::LabelLayout;
using picture::MakePaint;

constexpr double kRoomDotPx = 4.0;
constexpr double kAgentDotPx = 3.0;
constexpr double kSmallDotPx = 2.0;
constexpr double kPadPx = 6.0;
// Of the dot that stands for a room without an outline.
constexpr double kRoomRadiusPx = 14.0;
constexpr double kObjectRadiusPx = 7.0;
constexpr uint32_t kInkRgb = 0x20242e;

struct Label {
  std::string text;
  double dot_px = kSmallDotPx;
  uint32_t rgb = kInkRgb;

  Eigen::Vector2d Size() const {
    return {Canvas::TextWidth(text, dot_px) + 2.0 * kPadPx,
            dot_px * (picture::kGlyphHeightDots + picture::kDescentDots) + 2.0 * kPadPx};
  }
  Box2d At(const Eigen::Vector2d& middle) const {
    return Box2d(middle - 0.5 * Size(), middle + 0.5 * Size());
  }
};

void Write(const Label& label, const Box2d& spot, Canvas* canvas) {
  canvas->FillRect(spot.min(), spot.max(), MakePaint(0xffffff, 0.72f));
  canvas->DrawText(spot.min() + Eigen::Vector2d(kPadPx, kPadPx), label.text, label.dot_px,
                   MakePaint(label.rgb));
}

Box2d BoundsOf(const Polygon2d& polygon) {
  Box2d bounds;
  for (const Eigen::Vector2d& corner : polygon) bounds.extend(corner);
  return bounds;
}

bool HoldsBox(const Polygon2d& polygon, const Box2d& box) {
  using Corner = Box2d::CornerType;
  const std::array<Corner, 4> corners = {Box2d::BottomLeft, Box2d::BottomRight, Box2d::TopLeft,
                                         Box2d::TopRight};
  return std::all_of(corners.begin(), corners.end(),
                     [&](Corner corner) { return PolygonContains(polygon, box.corner(corner)); });
}

// "O(61)": what importers make up for nodes without a name.
bool IsMadeUpName(const std::string& name) {
  return name.size() > 3 && name[1] == '(' && name.back() == ')';
}

std::string ObjectText(const Node& node) {
  const bool has_class = !node.class_name.empty();
  return has_class && (node.name.empty() || IsMadeUpName(node.name)) ? node.class_name : node.name;
}

// "office 4", "R7 kitchen": the name, and the class where the name does not tell it.
std::string RoomText(const Node& node) {
  const std::string name = NameOf(node);
  const bool tells =
      absl::StrContains(absl::AsciiStrToLower(name), absl::AsciiStrToLower(node.class_name));
  return tells ? name : absl::StrCat(name, " ", node.class_name);
}

struct Shape {
  const Node* node = nullptr;
  Polygon2d outline_px;
  double area_px = 0.0;
};

// Nodes of one kind, the largest first, then by id.
std::vector<Shape> ShapesOf(const MapContent& content, const char* kind, const FloorView& view) {
  std::vector<Shape> shapes;
  for (const Node& node : content.nodes) {
    if (node.kind != kind) continue;
    Shape shape{.node = &node, .outline_px = view.ToPixels(FloorOutline(node))};
    shape.area_px = AreaOf(shape.outline_px);
    shapes.push_back(std::move(shape));
  }
  std::stable_sort(shapes.begin(), shapes.end(),
                   [](const Shape& a, const Shape& b) { return a.area_px > b.area_px; });
  return shapes;
}

// Spots in a room: its middle, then rings of others around it.
std::vector<Box2d> SpotsInRoom(const Shape& room, const Label& label) {
  constexpr int kSteps = 4;
  const Box2d bounds = BoundsOf(room.outline_px);
  std::vector<std::pair<double, Box2d>> spots;
  for (int y = -kSteps; y <= kSteps; ++y) {
    for (int x = -kSteps; x <= kSteps; ++x) {
      const Eigen::Vector2d part = Eigen::Vector2d(x, y) / (2.0 * kSteps + 1.0);
      const Box2d spot = label.At(bounds.center() + part.cwiseProduct(bounds.sizes()));
      if (HoldsBox(room.outline_px, spot)) spots.emplace_back(part.squaredNorm(), spot);
    }
  }
  std::stable_sort(spots.begin(), spots.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Box2d> out;
  for (const auto& [distance, spot] : spots) out.push_back(spot);
  return out;
}

std::optional<Box2d> FirstFree(const std::vector<Box2d>& spots, const LabelLayout& layout) {
  const auto it = std::find_if(spots.begin(), spots.end(),
                               [&](const Box2d& spot) { return layout.IsFree(spot); });
  return it == spots.end() ? std::nullopt : std::optional(*it);
}

// On the thing itself if it is large enough, otherwise beside it.
std::vector<Box2d> SpotsBeside(const Box2d& thing, const Label& label) {
  const Eigen::Vector2d reach = 0.5 * (thing.sizes() + label.Size());
  const Eigen::Vector2d middle = thing.center();
  std::vector<Box2d> spots;
  if (thing.contains(label.At(middle))) spots.push_back(label.At(middle));
  for (const Eigen::Vector2d& side : {Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1),
                                      Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0)}) {
    spots.push_back(label.At(middle + side.cwiseProduct(reach)));
  }
  return spots;
}

// False where all room is taken.
bool WriteBeside(const Box2d& thing, const Label& label, LabelLayout* layout, Canvas* canvas) {
  const std::optional<Box2d> spot = FirstFree(SpotsBeside(thing, label), *layout);
  if (!spot.has_value()) return false;
  layout->Block(*spot);
  Write(label, *spot, canvas);
  return true;
}

// Large letters clear of objects; else small ones; else over objects; else beside the room.
void WriteRoom(const Shape& room, const FloorView& view, LabelLayout* with_objects,
               LabelLayout* layout, Canvas* canvas) {
  for (const bool avoids_objects : {true, false}) {
    for (const double dot_px : {kRoomDotPx, 3.0, kSmallDotPx}) {
      const Label label{.text = RoomText(*room.node), .dot_px = dot_px};
      const std::optional<Box2d> spot =
          FirstFree(SpotsInRoom(room, label), avoids_objects ? *with_objects : *layout);
      if (!spot.has_value()) continue;
      Write(label, *spot, canvas);
      layout->Block(*spot);
      with_objects->Block(*spot);
      return;
    }
  }
  Box2d bounds = BoundsOf(room.outline_px);
  bounds.extend(view.ToPixel(MiddleOf(*room.node)));
  const Eigen::Vector2d reach(kRoomRadiusPx, kRoomRadiusPx);
  const Box2d dot(bounds.min() - reach, bounds.max() + reach);
  WriteBeside(dot, {.text = RoomText(*room.node)}, layout, canvas);
}

void WriteAgents(const MapContent& content, const FloorView& view, LabelLayout* layout,
                 Canvas* canvas) {
  constexpr double kDotRadiusPx = 16.0;
  const auto nodes = NodesById(content);
  for (size_t i = 0; i < content.tracks.size(); ++i) {
    const Eigen::Vector2d middle = view.ToPixel(LastOf(content.tracks[i]));
    const Eigen::Vector2d reach(kDotRadiusPx, kDotRadiusPx);
    const Label label{.text = NameOf(*nodes.at(content.tracks[i].agent)),
                      .dot_px = kAgentDotPx,
                      .rgb = AgentColor(i)};
    WriteBeside(Box2d(middle - reach, middle + reach), label, layout, canvas);
  }
}

}  // namespace

void DrawLabels(const MapContent& content, const std::set<NodeId>& named, const FloorView& view,
                LabelLayout* layout, Canvas* canvas) {
  const std::vector<Shape> objects = ShapesOf(content, kinds::kObject, view);
  LabelLayout with_objects = *layout;
  for (const Shape& object : objects) {
    if (!object.outline_px.empty()) with_objects.Block(BoundsOf(object.outline_px));
  }
  for (const Shape& room : ShapesOf(content, kinds::kRoom, view)) {
    if (!named.contains(room.node->id)) WriteRoom(room, view, &with_objects, layout, canvas);
  }
  WriteAgents(content, view, layout, canvas);
  for (const Shape& object : objects) {
    const Node& node = *object.node;
    if (named.contains(node.id)) continue;
    Box2d bounds = BoundsOf(object.outline_px);
    const Eigen::Vector2d middle = view.ToPixel(MiddleOf(node));
    // No smaller than the dot that stands for the smallest.
    bounds.extend(Box2d(middle.array() - kObjectRadiusPx, middle.array() + kObjectRadiusPx));
    const std::string text = ObjectText(node);
    if (!text.empty()) WriteBeside(bounds, {.text = text}, layout, canvas);
  }
}

void WriteNameBeside(const Box2d& thing_px, const std::string& name, uint32_t rgb,
                     LabelLayout* layout, Canvas* canvas) {
  const Label label{.text = name, .dot_px = kAgentDotPx, .rgb = rgb};
  // Close by if it can be, a little off otherwise.
  for (const double off_px : {0.0, 30.0, 60.0, 100.0}) {
    const Eigen::Vector2d off(off_px, off_px);
    if (WriteBeside(Box2d(thing_px.min() - off, thing_px.max() + off), label, layout, canvas)) {
      return;
    }
  }
}

}  // namespace dsg::cli
