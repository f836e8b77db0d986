// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/exploded_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "query/cli/export/outline.h"
#include "query/cli/export/top_view.h"
#include "query/cli/export/top_view_labels.h"
#include "query/cli/export/top_view_marks.h"
#include "schema/base/check.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"
#include "schema/picture/wire.h"

namespace dsg::cli {
namespace {

using Pixels = std::vector<Eigen::Vector2d>;

// Of the canvas, which is twice the size of the picture.
constexpr double kEdgePx = 60.0;
constexpr double kHeadPx = 80.0;
constexpr double kNamePx = 260.0;
constexpr double kNameDotPx = 4.0;
constexpr double kLevelDotPx = 3.0;
// Names keep away from the border of the picture.
constexpr double kBorderPx = 16.0;
constexpr uint32_t kPlateRgb = 0xe9e7e0;

// Where the eye stands: turned off the axes, so that walls along them do not hide one another.
constexpr double kTurnRad = 20.0 * std::numbers::pi / 180.0;
constexpr double kElevationRad = 38.0 * std::numbers::pi / 180.0;
// Between layers, shares of the picture's height of one.
constexpr double kGapShare = 0.6;
// Ceilings and lamps would hide the rooms.
constexpr double kMeshCutM = 2.0;

enum Level { kMeshLevel, kObjectLevel, kPlaceLevel, kRoomLevel, kBuildingLevel, kLevelCount };
constexpr std::array<const char*, kLevelCount> kLevelNames = {
    "mesh", "objects and agents", "places and structures", "rooms", "building"};

Level LevelOf(const Node& node) {
  if (node.kind == kinds::kObject || IsAgentKind(node.kind)) return kObjectLevel;
  if (node.kind == kinds::kPlace || node.kind == kinds::kStructure) return kPlaceLevel;
  if (node.kind == kinds::kBuilding) return kBuildingLevel;
  return node.kind == kinds::kRoom ? kRoomLevel : kLevelCount;
}

bool IsOfType(const Node& node, const char* type) {
  return node.structure.has_value() && node.structure->structure_type == type;
}

// From the map and a level to pixels: a view from infinity.
class Oblique {
 public:
  // `edge_px`: what stays free on the left, for names of levels; `legend_px`: at the bottom.
  Oblique(const Box3d& bounds, const std::array<bool, kLevelCount>& has, double edge_px,
          double legend_px, int width_px)
      : bounds_(bounds) {
    Eigen::AlignedBox2d plane;
    for (int corner = 0; corner < 8; ++corner) {
      plane.extend(
          Flat(bounds.corner(static_cast<Box3d::CornerType>(corner)) - bounds.center(), 0.0));
    }
    const double gap_m = kGapShare * plane.sizes().y() / std::cos(kElevationRad);
    double lift_m = 0.0;
    for (int level = 0; level < kLevelCount; ++level) {
      lift_m_[level] = lift_m;
      if (has[level]) lift_m += gap_m;
    }
    const double top_m = std::max(0.0, lift_m - gap_m) * std::cos(kElevationRad);
    const double width = 2.0 * width_px - kEdgePx - edge_px;
    const double height_max = 2.0 * kTopViewWidthMax - 2.0 * kEdgePx - kHeadPx - legend_px;
    px_per_m_ = std::min(width / plane.sizes().x(), height_max / (plane.sizes().y() + top_m));
    legend_y_ = std::round(px_per_m_ * (plane.sizes().y() + top_m) + kEdgePx + kHeadPx);
    height_px_ = legend_y_ + legend_px + kEdgePx;
    origin_px_ = Eigen::Vector2d(edge_px - px_per_m_ * plane.min().x(),
                                 legend_y_ - px_per_m_ * plane.max().y());
  }

  double height_px() const { return height_px_; }
  // Where the drawn map ends.
  double legend_y() const { return legend_y_; }
  Eigen::Vector2d ToPixel(const Eigen::Vector3d& point_map, int level) const {
    return origin_px_ + px_per_m_ * Flat(point_map - bounds_.center(), lift_m_[level]);
  }
  Pixels ToPixels(const Polygon2d& outline_map, double z_m, int level) const {
    Pixels pixels;
    for (const Eigen::Vector2d& corner : outline_map) {
      pixels.push_back(ToPixel({corner.x(), corner.y(), z_m}, level));
    }
    return pixels;
  }
  // Larger is nearer to the eye.
  static double NearnessOf(const Eigen::Vector3d& point_map) {
    const double away = std::sin(kTurnRad) * point_map.x() + std::cos(kTurnRad) * point_map.y();
    return std::sin(kElevationRad) * point_map.z() - std::cos(kElevationRad) * away;
  }

 private:
  static Eigen::Vector2d Flat(const Eigen::Vector3d& point, double lift_m) {
    const double right = std::cos(kTurnRad) * point.x() - std::sin(kTurnRad) * point.y();
    const double away = std::sin(kTurnRad) * point.x() + std::cos(kTurnRad) * point.y();
    return {right,
            -std::sin(kElevationRad) * away - std::cos(kElevationRad) * (point.z() + lift_m)};
  }

  Box3d bounds_;
  std::array<double, kLevelCount> lift_m_{};
  double px_per_m_ = 1.0;
  double height_px_ = 0.0;
  double legend_y_ = 0.0;
  Eigen::Vector2d origin_px_ = Eigen::Vector2d::Zero();
};

Box3d BoundsOf(const MapContent& content) {
  Box3d bounds;
  for (const Node& node : content.nodes) {
    if (LevelOf(node) == kLevelCount) continue;
    bounds.extend(MiddleOf(node));
    if (!node.box_node.isEmpty() && node.kind != kinds::kPlace) bounds.extend(node.BoxMap());
  }
  for (const Track& track : content.tracks) {
    for (const auto& piece : track.pieces) {
      for (const Eigen::Vector3d& point : piece) bounds.extend(point);
    }
  }
  for (const MeshBlock& block : content.mesh) {
    for (const Eigen::Vector3f& point : block.positions_map) bounds.extend(point.cast<double>());
  }
  for (const AgentBodies& agent : content.bodies) {
    for (const Body& body : agent.bodies) {
      for (const Eigen::Vector3f& point : body.points_map) bounds.extend(point.cast<double>());
    }
  }
  if (bounds.isEmpty()) bounds.extend(Eigen::Vector3d::Zero());
  // A flat or a tiny map has a size, too.
  const Eigen::Vector3d lack = (Eigen::Vector3d(2.0, 2.0, 0.5) - bounds.sizes()).cwiseMax(0.0);
  return {bounds.min() - 0.5 * lack, bounds.max() + 0.5 * lack};
}

picture::Paint Shaded(uint32_t rgb, double light, float opacity) {
  picture::Paint paint = picture::MakePaint(rgb, opacity);
  for (float* channel : {&paint.red, &paint.green, &paint.blue}) {
    *channel *= static_cast<float>(light);
  }
  return paint;
}

class Drawer {
 public:
  Drawer(const MapContent& content, int width_px)
      : Drawer(content, BoundsOf(content), LevelsOf(content),
               LegendRows(MapLegend(content), LegendSpaceOf(width_px)), kEdgePx + kNamePx,
               width_px) {}

  Drawer(const MapContent& content, const Box3d& bounds, const std::array<bool, kLevelCount>& has,
         LegendRows legend, double edge_px, int width_px)
      : content_(content),
        bounds_(bounds),
        has_(has),
        legend_(std::move(legend)),
        view_(bounds_, has_, edge_px, LegendPx(legend_), width_px),
        nodes_(NodesById(content)),
        parent_of_(ParentsOf(content)),
        canvas_(2 * width_px, 2 * static_cast<int>(std::ceil(0.5 * view_.height_px())),
                picture::MakePaint(kPaperRgb)),
        names_(Eigen::AlignedBox2d(
            Eigen::Vector2d(kBorderPx, kHeadPx),
            Eigen::Vector2d(canvas_.width() - kBorderPx, view_.legend_y() + kEdgePx))) {}

  picture::Picture Draw(const std::string& title) {
    for (int level = 0; level < kLevelCount; ++level) {
      if (!has_[level]) continue;
      DrawPlate(level);
      DrawContainment(static_cast<Level>(level));
      if (level == kMeshLevel) DrawMesh();
      if (level == kObjectLevel) {
        DrawObjects();
        DrawBodies();
      }
      if (level == kPlaceLevel) DrawPlaces();
      if (level == kRoomLevel) DrawRooms();
      if (level == kBuildingLevel) DrawNamed(kinds::kBuilding);
    }
    legend_.Draw({kEdgePx, view_.legend_y() + kEdgePx}, &canvas_);
    DrawTitle(title);
    return canvas_.Halved();
  }

  picture::Picture DrawMeshAlone(const std::string& title) {
    DrawMesh();
    DrawTitle(title);
    return canvas_.Halved();
  }

 private:
  static LegendSpace LegendSpaceOf(int width_px) {
    const double row_px = 2.0 * width_px - 2.0 * kEdgePx;
    return {row_px, row_px, LegendRowsMax(width_px)};
  }
  // With the space above it.
  static double LegendPx(const LegendRows& legend) {
    return legend.height_px() > 0.0 ? legend.height_px() + kEdgePx : 0.0;
  }

  void DrawTitle(const std::string& title) {
    double dot = 6.0;
    while (dot > 2.0 && picture::Canvas::TextWidth(title, dot) > canvas_.width() - 2.0 * kEdgePx)
      dot -= 1.0;
    canvas_.DrawText({kEdgePx, kEdgePx - 10.0}, title, dot, picture::MakePaint(kInkRgb));
  }

  static std::array<bool, kLevelCount> LevelsOf(const MapContent& content) {
    std::array<bool, kLevelCount> has{};
    has[kMeshLevel] = std::any_of(content.mesh.begin(), content.mesh.end(),
                                  [](const MeshBlock& block) { return !block.faces.empty(); });
    has[kObjectLevel] = !content.tracks.empty();
    for (const Node& node : content.nodes) {
      const Level level = LevelOf(node);
      if (level != kLevelCount) has[level] = true;
    }
    return has;
  }

  Eigen::Vector2d PixelOf(const Node& node) const {
    Eigen::Vector3d middle = MiddleOf(node);
    if (node.kind != kinds::kObject) middle.z() = bounds_.min().z();
    return view_.ToPixel(middle, LevelOf(node));
  }

  void DrawPlate(int level) {
    const double x[] = {bounds_.min().x(), bounds_.max().x()};
    const double y[] = {bounds_.min().y(), bounds_.max().y()};
    const Pixels plate = view_.ToPixels({{x[0], y[0]}, {x[1], y[0]}, {x[1], y[1]}, {x[0], y[1]}},
                                        bounds_.min().z(), level);
    canvas_.FillPolygon(plate, picture::MakePaint(kPlateRgb, 0.2f));
    canvas_.DrawOutline(plate, 2.0, picture::MakePaint(kInkRgb, 0.25f));
    const auto left = std::min_element(plate.begin(), plate.end(),
                                       [](const auto& a, const auto& b) { return a.x() < b.x(); });
    const Eigen::Vector2d low(kEdgePx, left->y() - 14.0);
    const char* name = kLevelNames[static_cast<size_t>(level)];
    canvas_.DrawText(low, name, kLevelDotPx, picture::MakePaint(kInkRgb));
    const Eigen::Vector2d size(picture::Canvas::TextWidth(name, kLevelDotPx),
                               kLevelDotPx * (picture::kCapHeightDots + picture::kDescentDots));
    names_.Block({low, low + size});
  }

  // From a level to what contains its nodes, drawn before the nodes above.
  void DrawContainment(Level level) {
    for (const Node& child : content_.nodes) {
      const auto parent = parent_of_.find(child.id);
      if (parent == parent_of_.end() || LevelOf(*parent->second) != level) continue;
      if (LevelOf(child) == kLevelCount) continue;
      canvas_.DrawPolyline({PixelOf(child), PixelOf(*parent->second)}, 1.5,
                           picture::MakePaint(kInkRgb, 0.13f));
    }
  }

  void DrawMesh() {
    struct Face {
      double nearness = 0.0;
      Pixels corners;
      picture::Paint paint;
    };
    const MeshColor color = SettleColor(content_.mesh, MeshColor::kAuto);
    std::vector<Face> faces;
    for (const MeshBlock& block : content_.mesh) {
      const std::vector<Eigen::Vector3f> normals = NormalsOf(block);
      for (const auto& face : block.faces) {
        Face drawn;
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const uint32_t vertex : face) {
          const Eigen::Vector3d corner = block.positions_map[vertex].cast<double>();
          middle += corner / 3.0;
          drawn.corners.push_back(view_.ToPixel(corner, kMeshLevel));
        }
        if (middle.z() > bounds_.min().z() + kMeshCutM) continue;
        const Eigen::Vector3f& normal = normals[face[0]];
        const double light = 0.75 + 0.25 * static_cast<double>(std::abs(normal.z()));
        drawn.paint = Shaded(VertexColor(block, face[0], color), light, 1.0f);
        drawn.nearness = Oblique::NearnessOf(middle);
        faces.push_back(std::move(drawn));
      }
    }
    std::stable_sort(faces.begin(), faces.end(),
                     [](const Face& a, const Face& b) { return a.nearness < b.nearness; });
    for (const Face& face : faces) canvas_.FillPolygon(face.corners, face.paint);
  }

  void DrawObjects() {
    std::vector<const Node*> objects;
    for (const Node& node : content_.nodes) {
      if (node.kind == kinds::kObject) objects.push_back(&node);
    }
    std::stable_sort(objects.begin(), objects.end(), [](const Node* a, const Node* b) {
      return Oblique::NearnessOf(MiddleOf(*a)) < Oblique::NearnessOf(MiddleOf(*b));
    });
    for (const Node* node : objects) DrawBox(*node, ClassColor(*node), 0.85f);
    for (size_t i = 0; i < content_.tracks.size(); ++i) {
      const Track& track = content_.tracks[i];
      for (const auto& piece : track.pieces) {
        Pixels pixels;
        for (const Eigen::Vector3d& point : piece) {
          pixels.push_back(view_.ToPixel(point, kObjectLevel));
        }
        canvas_.DrawPolyline(pixels, 3.0, picture::MakePaint(AgentColor(i), 0.7f));
      }
      if (HasBody(content_, track.agent)) continue;
      const auto node = nodes_.find(track.agent);
      DrawAgentMark(node == nodes_.end() ? kinds::kHuman : node->second->kind,
                    view_.ToPixel(LastOf(track), kObjectLevel), AgentColor(i), &canvas_);
    }
  }

  void DrawBodies() {
    // The way to the eye grows fastest towards it.
    const Eigen::Vector3d to_eye(Oblique::NearnessOf(Eigen::Vector3d::UnitX()),
                                 Oblique::NearnessOf(Eigen::Vector3d::UnitY()),
                                 Oblique::NearnessOf(Eigen::Vector3d::UnitZ()));
    for (const AgentBodies& agent : content_.bodies) {
      for (const Body& body : agent.bodies) {
        std::vector<LitFace> faces = LitFaces(body, agent.rgb, to_eye.normalized());
        std::stable_sort(faces.begin(), faces.end(), [](const LitFace& a, const LitFace& b) {
          return Oblique::NearnessOf(a.middle_map) < Oblique::NearnessOf(b.middle_map);
        });
        for (const LitFace& face : faces) {
          Pixels corners;
          for (const Eigen::Vector3d& corner : face.corners_map) {
            corners.push_back(view_.ToPixel(corner, kObjectLevel));
          }
          canvas_.FillPolygon(corners, face.paint);
        }
      }
    }
  }

  // The sides that are seen: sides of a box hide what is behind them.
  void DrawBox(const Node& node, uint32_t rgb, float opacity) {
    if (node.box_node.isEmpty()) {
      canvas_.FillCircle(PixelOf(node), 8.0, picture::MakePaint(rgb));
      return;
    }
    const int level = LevelOf(node);
    const std::array<Eigen::Vector3d, 8> corners = BoxCorners(node);
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        const Eigen::Vector3d out =
            (side == 1 ? 1.0 : -1.0) * (node.map_T_node.orientation * Eigen::Vector3d::Unit(axis));
        if (Oblique::NearnessOf(out) <= 0.0) continue;
        const int a = 1 << (axis + 1) % 3;
        const int b = 1 << (axis + 2) % 3;
        const int begin = side << axis;
        Pixels face;
        for (const int corner : {begin, begin | a, begin | a | b, begin | b}) {
          face.push_back(view_.ToPixel(corners[static_cast<size_t>(corner)], level));
        }
        canvas_.FillPolygon(face, Shaded(rgb, 0.7 + 0.3 * std::abs(out.z()), opacity));
        canvas_.DrawOutline(face, 1.5, picture::MakePaint(kInkRgb, 0.35f));
      }
    }
  }

  void DrawWall(const Node& node) {
    const std::vector<Eigen::Vector2d> line = SlantedWall(node);
    if (line.empty()) {
      if (!node.box_node.isEmpty()) DrawBox(node, kWallRgb, 0.1f);
      return;
    }
    const Box3d box = node.BoxMap();
    Pixels panel = view_.ToPixels({line[0], line[1]}, box.min().z(), kPlaceLevel);
    const Pixels top = view_.ToPixels({line[1], line[0]}, box.max().z(), kPlaceLevel);
    panel.insert(panel.end(), top.begin(), top.end());
    canvas_.FillPolygon(panel, picture::MakePaint(kWallRgb, 0.1f));
    canvas_.DrawOutline(panel, 1.5, picture::MakePaint(kInkRgb, 0.35f));
  }

  void DrawPlaces() {
    for (const Node& node : content_.nodes) {
      if (node.kind != kinds::kStructure || IsOfType(node, "floor") || IsOfType(node, "ceiling")) {
        continue;
      }
      DrawWall(node);
    }
    DrawLinks(relations::kTraversable, 2.0, picture::MakePaint(LayerColor(layers::kPlaces), 0.4f));
    for (const Node& node : content_.nodes) {
      if (node.kind != kinds::kPlace) continue;
      canvas_.FillCircle(PixelOf(node), 6.0, picture::MakePaint(PlaceColor(node, parent_of_)));
    }
  }

  void DrawLinks(const char* relation, double width, const picture::Paint& paint) {
    for (const Edge& edge : content_.edges) {
      if (edge.relation != relation) continue;
      canvas_.DrawPolyline({PixelOf(*nodes_.at(edge.source)), PixelOf(*nodes_.at(edge.target))},
                           width, paint);
    }
  }

  void DrawRooms() {
    for (const Node& node : content_.nodes) {
      if (node.kind != kinds::kRoom) continue;
      const Pixels outline = view_.ToPixels(FloorOutline(node), bounds_.min().z(), kRoomLevel);
      canvas_.FillPolygon(outline, picture::MakePaint(FloorColor(node), 0.8f));
      canvas_.DrawOutline(outline, 2.0, picture::MakePaint(kInkRgb, 0.4f));
    }
    DrawLinks(relations::kAdjacent, 5.0, picture::MakePaint(kRoomLinkRgb, 0.8f));
    DrawNamed(kinds::kRoom);
  }

  // All dots first, so that no name covers one.
  void DrawNamed(const char* kind) {
    constexpr double kDotReachPx = 15.0;
    const Eigen::Vector2d reach(kDotReachPx, kDotReachPx);
    for (const Node& node : content_.nodes) {
      if (node.kind != kind) continue;
      const Eigen::Vector2d at = PixelOf(node);
      const uint32_t rgb =
          node.kind == kinds::kRoom ? RoomColor(node) : LayerColor(layers::kBuildings);
      canvas_.FillCircle(at, kDotReachPx, picture::MakePaint(kPaperRgb));
      canvas_.FillCircle(at, kDotReachPx - 3.0, picture::MakePaint(rgb));
      names_.Block({at - reach, at + reach});
    }
    for (const Node& node : content_.nodes) {
      if (node.kind != kind) continue;
      const Eigen::Vector2d at = PixelOf(node);
      const std::string name = node.class_name.empty() || !node.name.empty()
                                   ? NameOf(node)
                                   : node.class_name + " " + ToString(node.id);
      WriteNameBeside({at - reach, at + reach}, {.text = name, .dot_px = kNameDotPx}, &names_,
                      &canvas_);
    }
  }

  const MapContent& content_;
  Box3d bounds_;
  std::array<bool, kLevelCount> has_;
  LegendRows legend_;
  Oblique view_;
  std::unordered_map<NodeId, const Node*> nodes_;
  std::unordered_map<NodeId, const Node*> parent_of_;
  picture::Canvas canvas_;
  // Spots of names, of all levels.
  picture::LabelLayout names_;
};

}  // namespace

picture::Picture DrawExplodedView(const MapContent& content, const ExplodedOptions& options) {
  DSG_CHECK(options.width_px >= kTopViewWidthMin && options.width_px <= kTopViewWidthMax);
  return Drawer(content, options.width_px).Draw(options.title);
}

picture::Picture DrawMeshes(const std::vector<TitledMap>& maps, int width_px) {
  DSG_CHECK(!maps.empty() && width_px >= kTopViewWidthMin && width_px <= kTopViewWidthMax);
  MapContent all;
  for (const TitledMap& map : maps) {
    all.mesh.insert(all.mesh.end(), map.content.mesh.begin(), map.content.mesh.end());
  }
  const int part_px = width_px / static_cast<int>(maps.size());
  std::vector<picture::Picture> parts;
  for (const TitledMap& map : maps) {
    parts.push_back(Drawer(map.content, BoundsOf(all), {}, LegendRows({}, {}), kEdgePx, part_px)
                        .DrawMeshAlone(map.title));
  }
  // All have the same bounds, and so the same size.
  picture::Picture joined{part_px * static_cast<int>(maps.size()), parts[0].height, {}};
  const size_t row_bytes = 3 * static_cast<size_t>(part_px);
  for (int row = 0; row < joined.height; ++row) {
    for (const picture::Picture& part : parts) {
      const auto begin =
          part.rgb.begin() + static_cast<std::ptrdiff_t>(static_cast<size_t>(row) * row_bytes);
      joined.rgb.insert(joined.rgb.end(), begin, begin + static_cast<std::ptrdiff_t>(row_bytes));
    }
  }
  return joined;
}

}  // namespace dsg::cli
