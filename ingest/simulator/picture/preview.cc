// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/picture/preview.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "schema/picture/raster.h"

namespace dsg::simulator {
namespace {

using picture::Canvas;
using picture::MakePaint;
using picture::Paint;

// Twice what the file will have: the picture is halved at the end.
constexpr double kWorldWidthPx = 3200.0;
constexpr double kMarginPx = 70.0;
constexpr double kLegendPx = 90.0;
constexpr double kDotPx = 3.0;
constexpr double kTextHeightPx = 7 * kDotPx;

constexpr uint32_t kPaperRgb = 0xfbfaf7;
constexpr uint32_t kWallRgb = 0x3d4250;
constexpr uint32_t kGlassRgb = 0x8fd0ea;
constexpr uint32_t kDoorRgb = 0xd9a55b;
constexpr uint32_t kWideOpeningRgb = 0xf1dcb8;
constexpr uint32_t kInkRgb = 0x2b2f3a;

constexpr std::array<uint32_t, 12> kTrackRgb = {0xd1495b, 0x2274a5, 0x3c9d5f, 0xe08e1b,
                                                0x7b4fa3, 0x17a2a2, 0xb8457f, 0x6d7f1e,
                                                0x4c5bd4, 0xa4552b, 0x5a9bd5, 0x374151};

uint32_t RoomRgb(const std::string& class_name) {
  if (class_name == "corridor" || class_name == "hallway") return 0xf0ede6;
  if (class_name == "office" || class_name == "study") return 0xdfe9f3;
  if (class_name == "meeting room") return 0xe6e0f2;
  if (class_name == "kitchen") return 0xfbe8cf;
  if (class_name == "lounge" || class_name == "living room") return 0xdff0e0;
  if (class_name == "open office") return 0xe4ecdc;
  if (class_name == "lobby") return 0xf6efcf;
  if (class_name == "library" || class_name == "bedroom") return 0xf4e1e1;
  if (class_name == "restroom" || class_name == "bathroom") return 0xd9f0f1;
  return 0xe8e8e4;
}

/// Metres of the map to pixels of the canvas.
class View {
 public:
  explicit View(const Rect& bounds) : bounds_(bounds), scale_(kWorldWidthPx / bounds.sizes().x()) {}

  double scale() const { return scale_; }
  int width() const { return static_cast<int>(kWorldWidthPx + 2 * kMarginPx); }
  int height() const {
    return static_cast<int>(scale_ * bounds_.sizes().y() + 2 * kMarginPx + kLegendPx);
  }
  Eigen::Vector2d ToPixel(const Point& point) const {
    return {kMarginPx + scale_ * (point.x() - bounds_.min().x()),
            kMarginPx + scale_ * (bounds_.max().y() - point.y())};
  }
  void Fill(const Rect& rect, const Paint& paint, Canvas* canvas) const {
    canvas->FillRect(ToPixel(Point(rect.min().x(), rect.max().y())),
                     ToPixel(Point(rect.max().x(), rect.min().y())), paint);
  }

 private:
  Rect bounds_;
  double scale_;
};

void DrawBuilding(const World& world, const View& view, Canvas* canvas) {
  for (const Room& room : world.plan.rooms) {
    view.Fill(room.cell, MakePaint(RoomRgb(room.class_name)), canvas);
  }
  for (const Structure& part : world.plan.structures) {
    const uint32_t rgb = part.type == "glass" ? kGlassRgb : kWallRgb;
    if (part.IsObstacle()) view.Fill(part.rect, MakePaint(rgb), canvas);
  }
  for (const Door& door : world.plan.doors) {
    const bool is_door = door.kind == OpeningKind::kDoor;
    view.Fill(door.Opening(), MakePaint(is_door ? kDoorRgb : kWideOpeningRgb, 0.75f), canvas);
  }
}

void DrawFurniture(const World& world, const View& view, Canvas* canvas) {
  for (const Furniture& item : world.furniture) {
    const auto channel = [&](size_t i) { return static_cast<uint32_t>(item.color[i]); };
    const uint32_t rgb = channel(0) << 16 | channel(1) << 8 | channel(2);
    const Rect footprint = item.Footprint();
    if (item.on < 0) {
      // A soft shadow to the lower right tells furniture from floor.
      Rect shadow = footprint;
      shadow.translate(Point(0.05, -0.05));
      view.Fill(shadow, MakePaint(0x000000, 0.13f), canvas);
    }
    view.Fill(footprint, MakePaint(0x20242c, 0.75f), canvas);
    const double border = std::min(0.03, 0.2 * footprint.sizes().minCoeff());
    view.Fill(Inflate(footprint, -border), MakePaint(rgb), canvas);
  }
}

void DrawPlaces(const World& world, const View& view, Canvas* canvas) {
  const std::vector<Place>& places = world.places.places;
  for (const PlaceEdge& edge : world.places.edges) {
    canvas->DrawPolyline(
        {view.ToPixel(places[edge.from].position), view.ToPixel(places[edge.to].position)}, 1.5,
        MakePaint(0x6b7686, 0.28f));
  }
  for (const Place& place : places) {
    const bool doorway = place.door >= 0;
    canvas->FillCircle(view.ToPixel(place.position), doorway ? 7.0 : 5.0,
                       MakePaint(doorway ? 0xb5761d : 0x6b7686, doorway ? 0.9f : 0.55f));
  }
}

Paint TrackPaint(size_t index, float opacity) {
  return MakePaint(kTrackRgb[index % kTrackRgb.size()], opacity);
}

void DrawTracks(const std::vector<PreviewTrack>& tracks, const View& view, Canvas* canvas) {
  for (size_t i = 0; i < tracks.size(); ++i) {
    std::vector<Eigen::Vector2d> pixels;
    for (const Point& point : tracks[i].points) pixels.push_back(view.ToPixel(point));
    canvas->DrawPolyline(pixels, 5.0, TrackPaint(i, 0.75f));
  }
  // On top of all lines: a ring where each begins, a disk where it ends.
  for (size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].points.empty()) continue;
    canvas->FillCircle(view.ToPixel(tracks[i].points.front()), 12.0, TrackPaint(i, 1.0f));
    canvas->FillCircle(view.ToPixel(tracks[i].points.front()), 7.0, MakePaint(0xffffff));
    canvas->FillCircle(view.ToPixel(tracks[i].points.back()), 14.0, MakePaint(0xffffff));
    canvas->FillCircle(view.ToPixel(tracks[i].points.back()), 11.0, TrackPaint(i, 1.0f));
  }
}

/// Where a room's name goes: in the middle, as far up as there is no furniture.
Rect NameRect(const World& world, int room, const Point& size) {
  constexpr double kWallGapM = 0.2;
  constexpr double kStepM = 0.1;
  const Rect inside = world.plan.rooms[room].Interior();
  const double x = inside.center().x() - 0.5 * size.x();
  const auto at = [&](double y) { return Rect(Point(x, y), Point(x, y) + size); };
  const double y_top = inside.max().y() - kWallGapM - size.y();
  for (double y = y_top; y > inside.min().y(); y -= kStepM) {
    const Rect rect = at(y);
    const bool is_free =
        std::none_of(world.furniture.begin(), world.furniture.end(), [&](const Furniture& item) {
          return item.room == room && rect.intersects(item.Footprint());
        });
    if (is_free) return rect;
  }
  return at(y_top);
}

void DrawRoomNames(const World& world, const View& view, Canvas* canvas) {
  constexpr double kPadPx = 9.0;
  for (int i = 0; i < static_cast<int>(world.plan.rooms.size()); ++i) {
    const std::string& name = world.plan.rooms[i].name;
    const Point size_px(Canvas::TextWidth(name, kDotPx) + 2 * kPadPx, kTextHeightPx + 2 * kPadPx);
    const Rect rect = NameRect(world, i, size_px / view.scale());
    view.Fill(rect, MakePaint(0xffffff, 0.75f), canvas);
    const Eigen::Vector2d low = view.ToPixel(Point(rect.min().x(), rect.max().y()));
    canvas->DrawText(low + Eigen::Vector2d(kPadPx, kPadPx), name, kDotPx, MakePaint(kInkRgb));
  }
}

void DrawScaleBar(const View& view, double y, Canvas* canvas) {
  constexpr double kBarM = 5.0;
  const double length = kBarM * view.scale();
  const Eigen::Vector2d begin(canvas->width() - kMarginPx - length, y + 10.0);
  for (int metre = 0; metre < static_cast<int>(kBarM); ++metre) {
    const Eigen::Vector2d low = begin + Eigen::Vector2d(metre * view.scale(), 0.0);
    canvas->FillRect(low, low + Eigen::Vector2d(view.scale(), 10.0),
                     MakePaint(metre % 2 == 0 ? kInkRgb : 0xc4c6cc));
  }
  const double text_width = Canvas::TextWidth("5 m", kDotPx);
  canvas->DrawText(begin - Eigen::Vector2d(text_width + 16.0, 6.0), "5 m", kDotPx,
                   MakePaint(kInkRgb));
}

void DrawLegend(const std::vector<PreviewTrack>& tracks, double y, Canvas* canvas) {
  double x = kMarginPx;
  for (size_t i = 0; i < tracks.size(); ++i) {
    canvas->FillCircle(Eigen::Vector2d(x + 10.0, y + 15.0), 10.0, TrackPaint(i, 1.0f));
    canvas->DrawText(Eigen::Vector2d(x + 30.0, y + 5.0), tracks[i].name, kDotPx,
                     MakePaint(kInkRgb));
    x += 30.0 + Canvas::TextWidth(tracks[i].name, kDotPx) + 40.0;
  }
}

}  // namespace

absl::StatusOr<std::string> DrawPreview(const World& world,
                                        const std::vector<PreviewTrack>& tracks) {
  const View view(world.Bounds());
  Canvas canvas(view.width(), view.height(), MakePaint(kPaperRgb));
  DrawBuilding(world, view, &canvas);
  DrawPlaces(world, view, &canvas);
  DrawFurniture(world, view, &canvas);
  DrawTracks(tracks, view, &canvas);
  DrawRoomNames(world, view, &canvas);
  const double legend_y = canvas.height() - kMarginPx - kTextHeightPx;
  DrawLegend(tracks, legend_y, &canvas);
  DrawScaleBar(view, legend_y, &canvas);
  return picture::EncodePng(canvas.Halved());
}

}  // namespace dsg::simulator
