// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/top_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "query/cli/export/axes.h"
#include "query/cli/export/openings.h"
#include "query/cli/export/outline.h"
#include "query/cli/export/overlay.h"
#include "query/cli/export/top_view_labels.h"
#include "query/cli/export/top_view_marks.h"
#include "schema/base/check.h"
#include "schema/picture/font.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

// Pixels of the canvas, which is twice the size of the picture.
constexpr double kMarginPx = 60.0;
constexpr double kTitlePx = 70.0;
constexpr double kFooterPx = 80.0;
constexpr double kTextDotPx = 4.0;
constexpr double kTextHeightPx = kTextDotPx * picture::kCapHeightDots;
// The longest scale bar, share of the canvas; its text at the left with the gap to the legend.
constexpr double kScaleBarShare = 0.25;
constexpr double kScaleTextPx = 200.0;
// A smaller map is drawn with this size.
constexpr double kMapSizeMinM = 2.0;

constexpr uint32_t kGlassRgb = 0x8fd0ea;
constexpr uint32_t kGroundRgb = 0xefede6;

constexpr float kCutAboveFloorM = 1.4f;
// Share of the paper's colour in the mesh's.
constexpr float kPaleness = 0.45f;
constexpr float kPaper = 0.98f;

struct DrawnFace {
  float height_m = 0.0f;
  std::array<Eigen::Vector2f, 3> corners_map;
  picture::Paint paint;
};

// The lowest points of a mesh are often outliers below the floor.
float FloorHeight(const std::vector<MeshBlock>& mesh) {
  constexpr size_t kStride = 7;
  constexpr size_t kPart = 50;
  std::vector<float> heights;
  for (const MeshBlock& block : mesh) {
    for (size_t i = 0; i < block.faces.size(); i += kStride) {
      heights.push_back(block.positions_map[block.faces[i][0]].z());
    }
  }
  if (heights.empty()) return 0.0f;
  const auto low = heights.begin() + static_cast<ptrdiff_t>(heights.size() / kPart);
  std::nth_element(heights.begin(), low, heights.end());
  return *low;
}

picture::Paint PaintOf(const MeshBlock& block, const std::array<uint32_t, 3>& face,
                       MeshColor color) {
  picture::Paint paint;
  std::array<float*, 3> channels = {&paint.red, &paint.green, &paint.blue};
  for (const uint32_t vertex : face) {
    const picture::Paint corner = picture::MakePaint(VertexColor(block, vertex, color));
    const std::array<float, 3> parts = {corner.red, corner.green, corner.blue};
    for (size_t i = 0; i < 3; ++i) *channels[i] += parts[i] / 3.0f;
  }
  for (float* channel : channels) *channel += kPaleness * (kPaper - *channel);
  return paint;
}

// The mesh as a pale background, cut 1.4 m above its floor, so that neither ceilings nor lamps hide
// the rooms.
void DrawMesh(const std::vector<MeshBlock>& mesh, const FloorView& view, picture::Canvas* canvas) {
  const MeshColor color = SettleColor(mesh, MeshColor::kAuto);
  const float cut_m = FloorHeight(mesh) + kCutAboveFloorM;
  std::vector<DrawnFace> faces;
  for (const MeshBlock& block : mesh) {
    for (const auto& face : block.faces) {
      DrawnFace out;
      float sum_m = 0.0f;
      for (size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3f& corner = block.positions_map[face[i]];
        out.corners_map[i] = corner.head<2>();
        sum_m += corner.z();
      }
      out.height_m = sum_m / 3.0f;
      if (out.height_m > cut_m) continue;
      out.paint = PaintOf(block, face, color);
      faces.push_back(out);
    }
  }
  // Lower faces first; stable, so that the same map gives the same bytes.
  std::stable_sort(faces.begin(), faces.end(),
                   [](const DrawnFace& a, const DrawnFace& b) { return a.height_m < b.height_m; });
  for (const DrawnFace& face : faces) {
    Polygon2d corners;
    for (const Eigen::Vector2f& corner : face.corners_map) {
      corners.push_back(view.ToPixel(Eigen::Vector2d(corner.cast<double>())));
    }
    canvas->FillPolygon(corners, face.paint);
  }
}

std::string StructureType(const Node& node) {
  if (node.structure.has_value() && !node.structure->structure_type.empty()) {
    return node.structure->structure_type;
  }
  return node.class_name;
}

// Bounds of all that is drawn; empty if nothing is.
Eigen::AlignedBox2d DrawnBounds(const MapContent& content, const Overlay& overlay) {
  Eigen::AlignedBox2d bounds = BoundsOf(overlay);
  for (const Node& node : content.nodes) {
    if (IsAgentKind(node.kind)) continue;
    bounds.extend(Eigen::Vector2d(MiddleOf(node).head<2>()));
    if (node.kind == kinds::kPlace) continue;
    for (const Eigen::Vector2d& corner : FloorOutline(node)) bounds.extend(corner);
  }
  for (const Track& track : content.tracks) {
    for (const auto& piece : track.pieces) {
      for (const Eigen::Vector3d& point : piece) bounds.extend(Eigen::Vector2d(point.head<2>()));
    }
  }
  for (const AgentBodies& agent : content.bodies) {
    for (const Body& body : agent.bodies) {
      for (const Eigen::Vector3f& point : body.points_map) {
        bounds.extend(Eigen::Vector2d(point.head<2>().cast<double>()));
      }
    }
  }
  for (const MeshBlock& block : content.mesh) {
    for (const auto& face : block.faces) {
      const Eigen::Vector3f& corner = block.positions_map[face[0]];
      bounds.extend(Eigen::Vector2d(corner.head<2>().cast<double>()));
    }
  }
  return bounds;
}

// At least kMapSizeMinM wide and high.
Eigen::AlignedBox2d MapBounds(Eigen::AlignedBox2d bounds) {
  if (bounds.isEmpty()) bounds.extend(Eigen::Vector2d::Zero());
  const Eigen::Vector2d lack =
      (Eigen::Vector2d::Constant(kMapSizeMinM) - bounds.sizes()).cwiseMax(0.0);
  return Eigen::AlignedBox2d(bounds.min() - 0.5 * lack, bounds.max() + 0.5 * lack);
}

// The part of the canvas for the map: the full width, and a height that fits. `legend_px`: height
// of the rows of the legend above the last one.
Eigen::AlignedBox2d AreaFor(const Eigen::AlignedBox2d& bounds_map, int width_px, double legend_px) {
  const double width = 2.0 * width_px - 2.0 * kMarginPx - kAxisLeftPx;
  const double height_max = std::min(4.0 * width_px, 2.0 * kTopViewWidthMax) - 2.0 * kMarginPx -
                            kTitlePx - kAxisBottomPx - kFooterPx - legend_px;
  const double height = width * bounds_map.sizes().y() / bounds_map.sizes().x();
  const Eigen::Vector2d low(kMarginPx + kAxisLeftPx, kMarginPx + kTitlePx);
  return Eigen::AlignedBox2d(low,
                             low + Eigen::Vector2d(width, std::clamp(height, 60.0, height_max)));
}

// The box of a floor lies along the axes of the map: of a building that does not, it would reach
// far outside.
void DrawGround(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  if (std::ranges::any_of(content.nodes,
                          [](const Node& node) { return !SlantedWall(node).empty(); })) {
    return;
  }
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kStructure || StructureType(node) != "floor") continue;
    canvas->FillPolygon(view.ToPixels(FloorOutline(node)), picture::MakePaint(kGroundRgb));
  }
}

void DrawRooms(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  // Half transparent: boxes of rooms without an outline overlap, and a mesh may be below.
  const float opacity = content.mesh.empty() ? 0.8f : 0.35f;
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kRoom) continue;
    const Polygon2d outline = view.ToPixels(FloorOutline(node));
    if (outline.size() < 3) {
      canvas->FillCircle(view.ToPixel(MiddleOf(node)), 14.0, picture::MakePaint(FloorColor(node)));
      canvas->FillCircle(view.ToPixel(MiddleOf(node)), 6.0,
                         picture::MakePaint(LayerColor(node.layer)));
      continue;
    }
    canvas->FillPolygon(outline, picture::MakePaint(FloorColor(node), opacity));
    canvas->DrawOutline(outline, 2.0, picture::MakePaint(kWallRgb, 0.35f));
  }
}

void DrawStructures(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  // The wall over a door would shut it.
  const std::unordered_set<NodeId> over_head = StructuresOverHead(content);
  const Openings openings(content);
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kStructure || over_head.contains(node.id)) continue;
    const std::string type = StructureType(node);
    if (type == "floor" || type == "ceiling") continue;
    const picture::Paint paint =
        picture::MakePaint(type == "glass" || type == "window" ? kGlassRgb : kWallRgb);
    if (const auto pieces = openings.PiecesOf(node); pieces.has_value()) {
      for (const WallLine& piece : *pieces) {
        canvas->DrawPolyline({view.ToPixel(piece.from), view.ToPixel(piece.to)},
                             std::max(5.0, piece.thickness_m * view.px_per_m() + 3.0), paint);
      }
      continue;
    }
    const Polygon2d outline_map = FloorOutline(node);
    const std::vector<Eigen::Vector2d> wall = SlantedWall(node);
    if (!wall.empty()) {
      canvas->DrawPolyline({view.ToPixel(wall[0]), view.ToPixel(wall[1])}, 5.0, paint);
      continue;
    }
    const Polygon2d outline = view.ToPixels(outline_map);
    canvas->FillPolygon(outline, paint);
    // Walls may be planes without thickness.
    canvas->DrawOutline(outline, 3.0, paint);
  }
}

void DrawPlaces(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  const auto nodes = NodesById(content);
  for (const Edge& edge : content.edges) {
    if (edge.relation != relations::kTraversable) continue;
    canvas->DrawPolyline({view.ToPixel(MiddleOf(*nodes.at(edge.source))),
                          view.ToPixel(MiddleOf(*nodes.at(edge.target)))},
                         2.0, picture::MakePaint(LayerColor(layers::kPlaces), 0.35f));
  }
  const auto parents = ParentsOf(content);
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kPlace) continue;
    canvas->FillCircle(view.ToPixel(MiddleOf(node)), 5.0,
                       picture::MakePaint(PlaceColor(node, parents), 0.7f));
  }
}

void DrawRoomLinks(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  const auto nodes = NodesById(content);
  for (const Edge& edge : content.edges) {
    if (edge.relation != relations::kAdjacent) continue;
    canvas->DrawPolyline({view.ToPixel(MiddleOf(*nodes.at(edge.source))),
                          view.ToPixel(MiddleOf(*nodes.at(edge.target)))},
                         4.0, picture::MakePaint(kRoomLinkRgb, 0.5f));
  }
}

// Kinds without a shape of their own are dots, so that nothing is missing.
void DrawOthers(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  for (const Node& node : content.nodes) {
    if (LayerOfKind(node.kind).has_value() || node.region.has_value()) continue;
    canvas->FillCircle(view.ToPixel(MiddleOf(node)), 3.0,
                       picture::MakePaint(LayerColor(node.layer), 0.5f));
  }
}

void DrawObjects(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  std::vector<const Node*> objects;
  for (const Node& node : content.nodes) {
    if (node.kind == kinds::kObject) objects.push_back(&node);
  }
  // Higher objects are drawn over lower ones, as a cup over its table.
  const auto top_of = [](const Node* node) { return node->BoxMap().max().z(); };
  std::stable_sort(objects.begin(), objects.end(),
                   [&](const Node* a, const Node* b) { return top_of(a) < top_of(b); });
  for (const Node* node : objects) {
    const Polygon2d outline = view.ToPixels(FloorOutline(*node));
    if (outline.size() < 3 || std::abs(SignedArea(outline)) < 64.0) {
      canvas->FillCircle(view.ToPixel(MiddleOf(*node)), 6.0, picture::MakePaint(kInkRgb));
      canvas->FillCircle(view.ToPixel(MiddleOf(*node)), 4.0, picture::MakePaint(ClassColor(*node)));
      continue;
    }
    canvas->FillPolygon(outline, picture::MakePaint(ClassColor(*node), 0.6f));
    canvas->DrawOutline(outline, 2.5, picture::MakePaint(kInkRgb, 0.25f));
    canvas->DrawOutline(outline, 2.5, picture::MakePaint(ClassColor(*node), 0.7f));
  }
}

void DrawTracks(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  for (size_t i = 0; i < content.tracks.size(); ++i) {
    for (const auto& piece : content.tracks[i].pieces) {
      std::vector<Eigen::Vector2d> pixels;
      for (const Eigen::Vector3d& point : piece) pixels.push_back(view.ToPixel(point));
      canvas->DrawPolyline(pixels, 3.0, picture::MakePaint(AgentColor(i), 0.65f));
    }
  }
  const auto nodes = NodesById(content);
  for (size_t i = 0; i < content.tracks.size(); ++i) {
    if (HasBody(content, content.tracks[i].agent)) continue;
    const auto node = nodes.find(content.tracks[i].agent);
    DrawAgentMark(node == nodes.end() ? kinds::kHuman : node->second->kind,
                  view.ToPixel(LastOf(content.tracks[i])), AgentColor(i), canvas);
  }
}

// Seen from above, so higher faces hide lower ones.
void DrawPeople(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  for (const AgentBodies& agent : content.bodies) {
    for (const Body& body : agent.bodies) {
      std::vector<LitFace> faces = LitFaces(body, agent.rgb, Eigen::Vector3d::UnitZ());
      std::stable_sort(faces.begin(), faces.end(), [](const LitFace& a, const LitFace& b) {
        return a.middle_map.z() < b.middle_map.z();
      });
      for (const LitFace& face : faces) {
        Polygon2d corners;
        for (const Eigen::Vector3d& corner : face.corners_map) {
          corners.push_back(view.ToPixel(corner));
        }
        canvas->FillPolygon(corners, face.paint);
      }
    }
  }
}

void DrawScaleBar(const FloorView& view, double y, picture::Canvas* canvas) {
  constexpr int kParts = 5;
  const double length_m = RoundBelow(kScaleBarShare * canvas->width() / view.px_per_m());
  const double part_px = length_m * view.px_per_m() / kParts;
  const Eigen::Vector2d begin(canvas->width() - kMarginPx - kParts * part_px,
                              y + 0.5 * kTextHeightPx - 6.0);
  for (int i = 0; i < kParts; ++i) {
    const Eigen::Vector2d low = begin + Eigen::Vector2d(i * part_px, 0.0);
    canvas->FillRect(low, low + Eigen::Vector2d(part_px, 12.0),
                     picture::MakePaint(i % 2 == 0 ? kInkRgb : 0xc4c6cc));
  }
  const std::string text = absl::StrCat(length_m, " m");
  const double x = begin.x() - picture::Canvas::TextWidth(text, kTextDotPx) - 16.0;
  canvas->DrawText(Eigen::Vector2d(x, y), text, kTextDotPx, picture::MakePaint(kInkRgb));
}

void DrawTitle(const std::string& title, picture::Canvas* canvas) {
  double dot = 6.0;
  const double width = canvas->width() - 2.0 * kMarginPx;
  while (dot > 2.0 && picture::Canvas::TextWidth(title, dot) > width) dot -= 1.0;
  canvas->DrawText(Eigen::Vector2d(kMarginPx, kMarginPx - 10.0), title, dot,
                   picture::MakePaint(kInkRgb));
}

void DrawAll(const MapContent& content, const FloorView& view, picture::Canvas* canvas) {
  DrawGround(content, view, canvas);
  DrawMesh(content.mesh, view, canvas);
  DrawRooms(content, view, canvas);
  DrawStructures(content, view, canvas);
  DrawOthers(content, view, canvas);
  DrawPlaces(content, view, canvas);
  DrawRoomLinks(content, view, canvas);
  DrawObjects(content, view, canvas);
  DrawTracks(content, view, canvas);
  DrawPeople(content, view, canvas);
}

}  // namespace

picture::Picture DrawTopView(const MapContent& content, const TopViewOptions& options) {
  DSG_CHECK(options.width_px >= kTopViewWidthMin && options.width_px <= kTopViewWidthMax);
  const Overlay& overlay = options.overlay;
  const double row_px = 2.0 * options.width_px - 2.0 * kMarginPx;
  const double beside_bar_px = row_px - kScaleBarShare * 2.0 * options.width_px - kScaleTextPx;
  const int row_count_max = LegendRowsMax(options.width_px);
  const LegendRows keys(OverlayLegend(overlay), {row_px, row_px, row_count_max});
  const LegendRows counts(MapLegend(content), {beside_bar_px, row_px, row_count_max});
  // The footer has one row, with the scale.
  const double more_px = keys.height_px() + std::max(0.0, counts.height_px() - kLegendRowPx);
  const Eigen::AlignedBox2d drawn_map = DrawnBounds(content, overlay);
  const Eigen::AlignedBox2d bounds_map = MapBounds(drawn_map);
  const FloorView view(bounds_map, AreaFor(bounds_map, options.width_px, more_px));
  // Whole pixels keep letters sharp.
  const double key_y =
      std::round(view.area_px().max().y() + kAxisBottomPx + kFooterPx - kTextHeightPx);
  const double height = key_y + kTextHeightPx + more_px + kMarginPx;
  picture::Canvas canvas(2 * options.width_px, 2 * static_cast<int>(std::ceil(0.5 * height)),
                         picture::MakePaint(kPaperRgb));
  DrawAll(content, view, &canvas);
  picture::LabelLayout layout(view.area_px());
  if (!overlay.empty()) {
    canvas.FillRect({0.0, 0.0}, {canvas.width(), canvas.height()},
                    picture::MakePaint(kPaperRgb, 0.4f));
    DrawOverlay(overlay, view, &layout, &canvas);
    DrawOverlayLabels(overlay, view, &layout, &canvas);
  }
  DrawLabels(content, overlay.named, view, &layout, &canvas);
  if (!drawn_map.isEmpty()) DrawAxes(view, &canvas);
  DrawTitle(options.title, &canvas);
  keys.Draw({kMarginPx, key_y}, &canvas);
  counts.Draw({kMarginPx, key_y + keys.height_px()}, &canvas);
  DrawScaleBar(view, key_y + keys.height_px(), &canvas);
  return canvas.Halved();
}

}  // namespace dsg::cli
