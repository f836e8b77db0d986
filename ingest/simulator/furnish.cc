// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/furnish.h"

#include <array>
#include <map>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/place_graph.h"

namespace dsg::simulator {
namespace {

constexpr int kTryCount = 40;
/// Between groups, so that boxes never touch.
constexpr double kGroupGapM = 0.06;
/// Kept free on both sides of a door, beyond its width to each side and in depth.
constexpr double kDoorSideM = 0.3;
constexpr double kDoorDepthM = 1.2;

Point Turned(const Point& point, int quarter_turns) {
  static constexpr std::array<std::array<int, 2>, 4> kCosSin = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  const auto [c, s] = kCosSin[quarter_turns % 4];
  return {c * point.x() - s * point.y(), s * point.x() + c * point.y()};
}

/// Where the origin of a group goes, and how it is turned.
struct Spot {
  Point origin;
  int quarter_turns = 0;
};

Spot DrawSpot(const Rect& interior, const GroupCount& entry, Random* random) {
  const Point size = interior.sizes();
  if (entry.placement == Placement::kCenter) {
    // The long axis of the group along the long axis of the room.
    const Point shift(random->Uniform(-0.4, 0.4), random->Uniform(-0.4, 0.4));
    return {interior.center() + shift, size.x() >= size.y() ? 0 : 1};
  }
  const double along_x = random->Uniform(0.0, size.x());
  const double along_y = random->Uniform(0.0, size.y());
  switch (random->Index(4)) {
    case 0:
      return {interior.min() + Point(along_x, 0.0), 0};
    case 1:
      return {Point(interior.max().x(), interior.min().y() + along_y), 1};
    case 2:
      return {Point(interior.min().x() + along_x, interior.max().y()), 2};
    default:
      return {Point(interior.min().x(), interior.min().y() + along_y), 3};
  }
}

std::vector<Furniture> MakeGroup(const GroupCount& entry, const Spot& spot, int room, int first,
                                 Random* random) {
  std::vector<Furniture> group;
  for (const Piece& piece : entry.group) {
    if (!random->Chance(piece.probability)) continue;
    Furniture item;
    item.class_name = piece.class_name;
    item.room = room;
    item.size = Eigen::Vector3d(piece.size_u, piece.size_v, piece.size_z);
    item.quarter_turns = (spot.quarter_turns + piece.quarter_turns) % 4;
    const Point middle = spot.origin + Turned(Point(piece.u, piece.v), spot.quarter_turns);
    double base = 0.0;
    if (piece.on >= 0) {
      // Pieces that carry others are always there, so their index is that of the table.
      item.on = first + piece.on;
      base = group[piece.on].center.z() + 0.5 * group[piece.on].size.z();
    }
    item.center = Eigen::Vector3d(middle.x(), middle.y(), base + 0.5 * piece.size_z);
    const std::vector<Color> colors = ColorsOf(item.class_name);
    item.color = colors[random->Index(static_cast<int>(colors.size()))];
    group.push_back(std::move(item));
  }
  return group;
}

std::vector<Rect> DoorKeepOuts(const FloorPlan& plan, int room) {
  std::vector<Rect> rects;
  for (const Door& door : plan.doors) {
    if (room != 0 && door.room != room) continue;
    const Point half(0.5 * door.width_m + kDoorSideM, kDoorDepthM);
    rects.push_back(Rect(door.center - half, door.center + half));
  }
  return rects;
}

bool Fits(const std::vector<Furniture>& group, const Rect& interior,
          const std::vector<Rect>& taken) {
  for (const Furniture& item : group) {
    if (item.on >= 0) continue;
    const Rect footprint = item.Footprint();
    if (!interior.contains(footprint)) return false;
    const Rect reach = Inflate(footprint, kGroupGapM);
    for (const Rect& other : taken) {
      if (reach.intersects(other)) return false;
    }
  }
  return true;
}

/// One room being furnished.
class RoomFurnisher {
 public:
  RoomFurnisher(const FloorPlan& plan, int room, std::vector<Furniture>* all)
      : plan_(plan), room_(room), all_(all), taken_(DoorKeepOuts(plan, room)) {
    for (const Structure& structure : plan.structures) {
      if (structure.room == room && structure.IsObstacle()) free_space_.Add(structure.rect);
    }
  }

  /// False if no try found a spot that leaves the room walkable.
  bool Place(const GroupCount& entry, Random* random) {
    const Rect interior = plan_.rooms[room_].Interior();
    for (int i = 0; i < kTryCount; ++i) {
      const Spot spot = DrawSpot(interior, entry, random);
      const std::vector<Furniture> group =
          MakeGroup(entry, spot, room_, static_cast<int>(all_->size()), random);
      if (!Fits(group, interior, taken_)) continue;
      FreeSpace with_group = free_space_;
      for (const Furniture& item : group) {
        if (item.on < 0) with_group.Add(item.Footprint());
      }
      if (!IsRoomWalkable(plan_, room_, with_group)) continue;
      free_space_ = std::move(with_group);
      for (const Furniture& item : group) {
        if (item.on < 0) taken_.push_back(item.Footprint());
        all_->push_back(item);
      }
      return true;
    }
    return false;
  }

 private:
  const FloorPlan& plan_;
  const int room_;
  std::vector<Furniture>* const all_;
  std::vector<Rect> taken_;
  FreeSpace free_space_;
};

void NameFurniture(std::vector<Furniture>* furniture) {
  std::map<std::string, int> count;
  for (const Furniture& item : *furniture) ++count[item.class_name];
  std::map<std::string, int> next;
  for (Furniture& item : *furniture) {
    item.name = count[item.class_name] == 1
                    ? item.class_name
                    : absl::StrCat(item.class_name, " ", ++next[item.class_name]);
  }
}

}  // namespace

std::vector<Furniture> Furnish(const FloorPlan& plan, Random* random) {
  std::vector<Furniture> furniture;
  for (int room = 0; room < static_cast<int>(plan.rooms.size()); ++room) {
    RoomFurnisher furnisher(plan, room, &furniture);
    for (const GroupCount& entry : FurnitureOf(plan.rooms[room].class_name)) {
      const int count = random->Integer(entry.min, entry.max);
      for (int i = 0; i < count; ++i) {
        if (!furnisher.Place(entry, random)) break;
      }
    }
  }
  NameFurniture(&furniture);
  return furniture;
}

FreeSpace FreeSpaceOf(const FloorPlan& plan, const std::vector<Furniture>& furniture) {
  FreeSpace free_space;
  for (const Structure& structure : plan.structures) {
    if (structure.IsObstacle()) free_space.Add(structure.rect);
  }
  for (const Furniture& item : furniture) {
    if (item.on < 0) free_space.Add(item.Footprint());
  }
  return free_space;
}

}  // namespace dsg::simulator
