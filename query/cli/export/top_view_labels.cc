// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/top_view_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "query/cli/export/outline.h"
#include "query/cli/export/top_view_marks.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

constexpr double kRoomDotPx = 4.0;
constexpr double kSmallDotPx = 2.0;
constexpr double kPadPx = 6.0;
// Radius of the dot for a room without an outline.
constexpr double kRoomRadiusPx = 14.0;
constexpr double kObjectRadiusPx = 7.0;

void WriteLabel(const Label& label, const Eigen::AlignedBox2d& spot, picture::Canvas* canvas) {
  canvas->FillRect(spot.min(), spot.max(), picture::MakePaint(0xffffff, 0.72f));
  canvas->DrawText(spot.min() + Eigen::Vector2d(kPadPx, kPadPx), label.text, label.dot_px,
                   picture::MakePaint(label.rgb));
}

Eigen::AlignedBox2d PolygonBounds(const Polygon2d& polygon) {
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector2d& corner : polygon) bounds.extend(corner);
  return bounds;
}

bool HoldsBox(const Polygon2d& polygon, const Eigen::AlignedBox2d& box) {
  using Corner = Eigen::AlignedBox2d::CornerType;
  const std::array<Corner, 4> corners = {
      Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
      Eigen::AlignedBox2d::TopLeft, Eigen::AlignedBox2d::TopRight};
  return std::all_of(corners.begin(), corners.end(),
                     [&](Corner corner) { return PolygonContains(polygon, box.corner(corner)); });
}

// "O(61)": importers make up such names for nodes without one.
bool IsMadeUpName(const std::string& name) {
  return name.size() > 3 && name[1] == '(' && name.back() == ')';
}

std::string ObjectLabel(const Node& node) {
  const bool has_class = !node.class_name.empty();
  return has_class && (node.name.empty() || IsMadeUpName(node.name)) ? node.class_name : node.name;
}

// "office 4", "R7 kitchen": the name, and the class if the name does not contain it.
std::string RoomLabel(const Node& node) {
  const std::string name = NameOf(node);
  const bool tells =
      absl::StrContains(absl::AsciiStrToLower(name), absl::AsciiStrToLower(node.class_name));
  return tells ? name : absl::StrCat(name, " ", node.class_name);
}

struct LabelledShape {
  const Node* node = nullptr;
  Polygon2d outline_px;
  double area_px = 0.0;
};

// Nodes of one kind, the largest first, then by id.
std::vector<LabelledShape> ShapesOf(const MapContent& content, const char* kind,
                                    const FloorView& view) {
  std::vector<LabelledShape> shapes;
  for (const Node& node : content.nodes) {
    if (node.kind != kind) continue;
    LabelledShape shape{.node = &node, .outline_px = view.ToPixels(FloorOutline(node))};
    shape.area_px = std::abs(SignedArea(shape.outline_px));
    shapes.push_back(std::move(shape));
  }
  std::stable_sort(
      shapes.begin(), shapes.end(),
      [](const LabelledShape& a, const LabelledShape& b) { return a.area_px > b.area_px; });
  return shapes;
}

// Positions in a room: its middle, then rings around it.
std::vector<Eigen::AlignedBox2d> SpotsInRoom(const LabelledShape& room, const Label& label) {
  constexpr int kSteps = 4;
  const Eigen::AlignedBox2d bounds = PolygonBounds(room.outline_px);
  std::vector<std::pair<double, Eigen::AlignedBox2d>> spots;
  for (int y = -kSteps; y <= kSteps; ++y) {
    for (int x = -kSteps; x <= kSteps; ++x) {
      const Eigen::Vector2d part = Eigen::Vector2d(x, y) / (2.0 * kSteps + 1.0);
      const Eigen::AlignedBox2d spot =
          label.At(bounds.center() + part.cwiseProduct(bounds.sizes()));
      if (HoldsBox(room.outline_px, spot)) spots.emplace_back(part.squaredNorm(), spot);
    }
  }
  std::stable_sort(spots.begin(), spots.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Eigen::AlignedBox2d> out;
  for (const auto& [distance, spot] : spots) out.push_back(spot);
  return out;
}

std::optional<Eigen::AlignedBox2d> FirstFree(const std::vector<Eigen::AlignedBox2d>& spots,
                                             const picture::LabelLayout& layout) {
  const auto it = std::find_if(spots.begin(), spots.end(), [&](const Eigen::AlignedBox2d& spot) {
    return layout.IsFree(spot);
  });
  return it == spots.end() ? std::nullopt : std::optional(*it);
}

// On the shape if it is large enough, otherwise beside it.
std::vector<Eigen::AlignedBox2d> SpotsBeside(const Eigen::AlignedBox2d& thing, const Label& label) {
  const Eigen::Vector2d reach = 0.5 * (thing.sizes() + label.Size());
  const Eigen::Vector2d middle = thing.center();
  std::vector<Eigen::AlignedBox2d> spots;
  if (thing.contains(label.At(middle))) spots.push_back(label.At(middle));
  for (const Eigen::Vector2d& side : {Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1),
                                      Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0)}) {
    spots.push_back(label.At(middle + side.cwiseProduct(reach)));
  }
  return spots;
}

// False without free space.
bool WriteBeside(const Eigen::AlignedBox2d& thing, const Label& label, picture::LabelLayout* layout,
                 picture::Canvas* canvas) {
  const std::optional<Eigen::AlignedBox2d> spot = FirstFree(SpotsBeside(thing, label), *layout);
  if (!spot.has_value()) return false;
  layout->Block(*spot);
  WriteLabel(label, *spot, canvas);
  return true;
}

// Beside a shape that is thought `off_px` larger on each side: straight, then over its corners.
std::vector<Eigen::AlignedBox2d> SpotsAround(const Eigen::AlignedBox2d& thing, double off_px,
                                             const Label& label) {
  const Eigen::Vector2d off(off_px, off_px);
  const Eigen::AlignedBox2d larger(thing.min() - off, thing.max() + off);
  std::vector<Eigen::AlignedBox2d> spots = SpotsBeside(larger, label);
  const Eigen::Vector2d reach = 0.5 * (larger.sizes() + label.Size());
  const Eigen::Vector2d middle = larger.center();
  for (const Eigen::Vector2d& corner : {Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1),
                                        Eigen::Vector2d(1, -1), Eigen::Vector2d(-1, -1)}) {
    spots.push_back(label.At(middle + corner.cwiseProduct(reach)));
  }
  return spots;
}

Eigen::Vector2d NearestIn(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& point) {
  return point.cwiseMax(box.min()).cwiseMin(box.max());
}

// In large letters clear of objects, else in smaller ones, else over objects, else beside the room.
void WriteRoom(const LabelledShape& room, const FloorView& view, picture::LabelLayout* with_objects,
               picture::LabelLayout* layout, picture::Canvas* canvas) {
  for (const bool avoids_objects : {true, false}) {
    for (const double dot_px : {kRoomDotPx, 3.0, kSmallDotPx}) {
      const Label label{.text = RoomLabel(*room.node), .dot_px = dot_px};
      const std::optional<Eigen::AlignedBox2d> spot =
          FirstFree(SpotsInRoom(room, label), avoids_objects ? *with_objects : *layout);
      if (!spot.has_value()) continue;
      WriteLabel(label, *spot, canvas);
      layout->Block(*spot);
      with_objects->Block(*spot);
      return;
    }
  }
  Eigen::AlignedBox2d bounds = PolygonBounds(room.outline_px);
  bounds.extend(view.ToPixel(MiddleOf(*room.node)));
  const Eigen::Vector2d reach(kRoomRadiusPx, kRoomRadiusPx);
  const Eigen::AlignedBox2d dot(bounds.min() - reach, bounds.max() + reach);
  WriteBeside(dot, {.text = RoomLabel(*room.node)}, layout, canvas);
}

// What an agent takes of the picture: its mark, and its body if that is drawn.
Eigen::AlignedBox2d AgentBox(const MapContent& content, const Track& track, const FloorView& view) {
  const Eigen::Vector2d middle = view.ToPixel(LastOf(track));
  const Eigen::Vector2d reach(kAgentMarkReachPx, kAgentMarkReachPx);
  Eigen::AlignedBox2d box(middle - reach, middle + reach);
  for (const AgentBodies& agent : content.bodies) {
    if (agent.agent != track.agent) continue;
    for (const Body& body : agent.bodies) {
      for (const Eigen::Vector3f& point : body.points_map) {
        box.extend(view.ToPixel(Eigen::Vector3d(point.cast<double>())));
      }
    }
  }
  return box;
}

void WriteAgents(const MapContent& content, const std::vector<Eigen::AlignedBox2d>& boxes,
                 picture::LabelLayout* layout, picture::Canvas* canvas) {
  const auto nodes = NodesById(content);
  for (size_t i = 0; i < content.tracks.size(); ++i) {
    const Label label{.text = NameOf(*nodes.at(content.tracks[i].agent)),
                      .dot_px = kAgentDotPx,
                      .rgb = AgentColor(i)};
    WriteBeside(boxes[i], label, layout, canvas);
  }
}

}  // namespace

Eigen::Vector2d Label::Size() const {
  return {picture::Canvas::TextWidth(text, dot_px) + 2.0 * kPadPx,
          dot_px * (picture::kCapHeightDots + picture::kDescentDots) + 2.0 * kPadPx};
}

Eigen::AlignedBox2d Label::At(const Eigen::Vector2d& middle) const {
  return Eigen::AlignedBox2d(middle - 0.5 * Size(), middle + 0.5 * Size());
}

void DrawLabels(const MapContent& content, const std::set<NodeId>& named, const FloorView& view,
                picture::LabelLayout* layout, picture::Canvas* canvas) {
  // No name hides an agent: where one stands says more than what a room is called.
  std::vector<Eigen::AlignedBox2d> agents;
  for (const Track& track : content.tracks) agents.push_back(AgentBox(content, track, view));
  for (const Eigen::AlignedBox2d& agent : agents) layout->Block(agent);
  const std::vector<LabelledShape> objects = ShapesOf(content, kinds::kObject, view);
  picture::LabelLayout with_objects = *layout;
  for (const LabelledShape& object : objects) {
    if (!object.outline_px.empty()) with_objects.Block(PolygonBounds(object.outline_px));
  }
  for (const LabelledShape& room : ShapesOf(content, kinds::kRoom, view)) {
    if (!named.contains(room.node->id)) WriteRoom(room, view, &with_objects, layout, canvas);
  }
  WriteAgents(content, agents, layout, canvas);
  for (const LabelledShape& object : objects) {
    const Node& node = *object.node;
    if (named.contains(node.id)) continue;
    Eigen::AlignedBox2d bounds = PolygonBounds(object.outline_px);
    const Eigen::Vector2d middle = view.ToPixel(MiddleOf(node));
    // At least the size of the smallest dot.
    bounds.extend(
        Eigen::AlignedBox2d(middle.array() - kObjectRadiusPx, middle.array() + kObjectRadiusPx));
    const std::string text = ObjectLabel(node);
    if (!text.empty()) WriteBeside(bounds, {.text = text}, layout, canvas);
  }
}

std::optional<Eigen::AlignedBox2d> WriteNameBeside(const Eigen::AlignedBox2d& thing_px,
                                                   const Label& label, picture::LabelLayout* layout,
                                                   picture::Canvas* canvas) {
  // As close as possible.
  for (const double off_px : {0.0, 30.0, 60.0, 100.0, 150.0}) {
    const std::optional<Eigen::AlignedBox2d> spot =
        FirstFree(SpotsAround(thing_px, off_px, label), *layout);
    if (!spot.has_value()) continue;
    if (off_px > 0.0) {
      canvas->DrawPolyline(
          {NearestIn(thing_px, spot->center()), NearestIn(*spot, thing_px.center())}, 2.0,
          picture::MakePaint(label.rgb, 0.7f));
    }
    layout->Block(*spot);
    WriteLabel(label, *spot, canvas);
    return spot;
  }
  return std::nullopt;
}

}  // namespace dsg::cli
