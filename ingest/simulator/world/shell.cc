// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/shell.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"

namespace dsg::simulator {
namespace {

constexpr double kSlabM = 0.1;
/// Pieces thinner than this come from rounding.
constexpr double kThinM = 1e-6;

/// One of the four walls of a room: the room's half of it.
struct Side {
  /// Into the room.
  Point normal;
  Rect rect;
  /// Axis along the wall.
  int along = 0;
};

std::vector<Side> SidesOf(const Room& room) {
  const Rect& cell = room.cell;
  const Rect inside = room.Interior();
  return {
      {Point(0, 1), Rect(cell.min(), Point(cell.max().x(), inside.min().y())), 0},
      {Point(0, -1), Rect(Point(cell.min().x(), inside.max().y()), cell.max()), 0},
      {Point(1, 0), Rect(cell.min(), Point(inside.min().x(), cell.max().y())), 1},
      {Point(-1, 0), Rect(Point(inside.max().x(), cell.min().y()), cell.max()), 1},
  };
}

/// What interrupts a wall.
struct Gap {
  Rect rect;
  bool is_glass = false;
  /// Where the wall goes on above an opening.
  double z_top_m = 0.0;
};

class ShellMaker {
 public:
  ShellMaker(const std::vector<Room>& rooms, const std::vector<Door>& doors,
             const std::vector<GlassFront>& glass)
      : rooms_(rooms), doors_(doors), glass_(glass) {}

  void AddRoom(int room, std::vector<Structure>* out) const {
    const Room& of = rooms_[room];
    for (const Side& side : SidesOf(of)) AddSide(room, side, out);
    out->push_back({"floor", room, of.cell, -kSlabM, 0.0, Eigen::Vector3d::UnitZ(), 0.0});
    out->push_back({"ceiling", room, of.cell, of.ceiling_m, of.ceiling_m + kSlabM,
                    Eigen::Vector3d(0.0, 0.0, -1.0), of.ceiling_m});
  }

 private:
  std::vector<Gap> GapsOf(int room, const Side& side) const {
    std::vector<Gap> gaps;
    const auto add = [&](const Rect& rect, bool is_glass, double z_top_m) {
      const Rect part = rect.intersection(side.rect);
      if (part.isEmpty() || part.sizes().minCoeff() < kThinM) return;
      gaps.push_back({part, is_glass, z_top_m});
    };
    for (const Door& door : doors_) {
      if (!door.Joins(room) || door.walks_along_y != (side.along == 0)) continue;
      const double low_ceiling =
          std::min(rooms_[door.room_a].ceiling_m, rooms_[door.room_b].ceiling_m);
      add(door.Opening(), false, door.kind == OpeningKind::kDoor ? kDoorHeightM : low_ceiling);
    }
    for (const GlassFront& front : glass_) {
      if (front.room_a == room || front.room_b == room) add(front.rect, true, 0.0);
    }
    std::sort(gaps.begin(), gaps.end(), [&](const Gap& a, const Gap& b) {
      return a.rect.min()[side.along] < b.rect.min()[side.along];
    });
    return gaps;
  }

  void AddSide(int room, const Side& side, std::vector<Structure>* out) const {
    Point begin = side.rect.min();
    for (const Gap& gap : GapsOf(room, side)) {
      Point end = side.rect.max();
      end[side.along] = gap.rect.min()[side.along];
      AddPiece("wall", room, side, Rect(begin, end), 0.0, out);
      AddPiece(gap.is_glass ? "glass" : "wall", room, side, gap.rect, gap.z_top_m, out);
      begin[side.along] = gap.rect.max()[side.along];
    }
    AddPiece("wall", room, side, Rect(begin, side.rect.max()), 0.0, out);
  }

  void AddPiece(const char* type, int room, const Side& side, const Rect& rect, double z_min,
                std::vector<Structure>* out) const {
    const double ceiling = rooms_[room].ceiling_m;
    if (rect.isEmpty() || rect.sizes().minCoeff() < kThinM || ceiling - z_min < kThinM) return;
    const Rect inside = rooms_[room].Interior();
    const Point face(side.normal.x() > 0 ? inside.min().x() : inside.max().x(),
                     side.normal.y() > 0 ? inside.min().y() : inside.max().y());
    out->push_back({type, room, rect, z_min, ceiling,
                    Eigen::Vector3d(side.normal.x(), side.normal.y(), 0.0),
                    -side.normal.dot(face)});
  }

  const std::vector<Room>& rooms_;
  const std::vector<Door>& doors_;
  const std::vector<GlassFront>& glass_;
};

}  // namespace

std::vector<Structure> DrawShell(const std::vector<Room>& rooms, const std::vector<Door>& doors,
                                 const std::vector<GlassFront>& glass,
                                 const std::vector<Pillar>& pillars) {
  const ShellMaker maker(rooms, doors, glass);
  std::vector<Structure> structures;
  for (int room = 0; room < static_cast<int>(rooms.size()); ++room) {
    maker.AddRoom(room, &structures);
    for (const Pillar& pillar : pillars) {
      if (pillar.room != room) continue;
      structures.push_back(
          {"pillar", room, pillar.rect, 0.0, rooms[room].ceiling_m, Eigen::Vector3d::Zero(), 0.0});
    }
  }
  return structures;
}

void NameRooms(std::vector<Room>* rooms) {
  std::map<std::string, int> count;
  for (const Room& room : *rooms) ++count[room.class_name];
  std::map<std::string, int> next;
  for (Room& room : *rooms) {
    room.name = count[room.class_name] == 1
                    ? room.class_name
                    : absl::StrCat(room.class_name, " ", ++next[room.class_name]);
  }
}

double Centimetres(double metres) { return std::round(metres * 100.0) / 100.0; }

}  // namespace dsg::simulator
