// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/furnish.h"

#include <array>
#include <map>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/world/place_graph.h"

namespace dsg::simulator {
namespace {

constexpr int kGroupTryCount = 40;
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
  if (entry.placement == Placement::kFloor) {
    const Point share(random->Uniform(), random->Uniform());
    return {interior.min() + size.cwiseProduct(share), random->Index(4)};
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
    if (!door.Joins(room)) continue;
    Point half(0.5 * door.width_m + kDoorSideM, kDoorDepthM);
    if (!door.walks_along_y) std::swap(half.x(), half.y());
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
      if (structure.room != room || !structure.IsObstacle()) continue;
      obstacles_.push_back(structure.rect);
      if (structure.type == "pillar") taken_.push_back(structure.rect);
    }
  }

  /// False if no try found a spot that leaves the room walkable.
  bool Place(const GroupCount& entry, Random* random) {
    const Rect interior = plan_.rooms[room_].Interior();
    for (int i = 0; i < kGroupTryCount; ++i) {
      const Spot spot = DrawSpot(interior, entry, random);
      const std::vector<Furniture> group =
          MakeGroup(entry, spot, room_, static_cast<int>(all_->size()), random);
      if (!Fits(group, interior, taken_)) continue;
      std::vector<Rect> with_group = obstacles_;
      for (const Furniture& item : group) {
        if (item.on < 0) with_group.push_back(item.Footprint());
      }
      if (!IsRoomWalkable(plan_, room_, FreeSpace(with_group))) continue;
      obstacles_ = std::move(with_group);
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
  std::vector<Rect> obstacles_;
};

/// Counts pieces by class.
class Stock {
 public:
  bool HasSpaceFor(std::span<const Piece> group) const {
    std::map<std::string, int> wanted;
    for (const Piece& piece : group) {
      const auto found = count_.find(piece.class_name);
      const int had = found == count_.end() ? 0 : found->second;
      if (had + ++wanted[piece.class_name] > kPiecesOfClassMax) return false;
    }
    return true;
  }
  void Add(const std::string& class_name) { ++count_[class_name]; }

 private:
  std::map<std::string, int> count_;
};

}  // namespace

std::vector<Furniture> Furnish(const FloorPlan& plan, Random* random) {
  std::vector<Furniture> furniture;
  Stock stock;
  for (int room = 0; room < static_cast<int>(plan.rooms.size()); ++room) {
    RoomFurnisher furnisher(plan, room, &furniture);
    const double area = plan.rooms[room].cell.volume();
    for (const GroupCount& entry : FurnitureOf(plan.rooms[room].class_name)) {
      int count = random->Integer(entry.min, entry.max);
      if (entry.m2_per_extra > 0.0 && area > kExtraFromM2) {
        count += static_cast<int>((area - kExtraFromM2) / entry.m2_per_extra);
      }
      for (int i = 0; i < count && stock.HasSpaceFor(entry.group); ++i) {
        const size_t before = furniture.size();
        if (!furnisher.Place(entry, random)) break;
        for (size_t k = before; k < furniture.size(); ++k) stock.Add(furniture[k].class_name);
      }
    }
  }
  return furniture;
}

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

FreeSpace FreeSpaceOf(const FloorPlan& plan, const std::vector<Furniture>& furniture) {
  std::vector<Rect> obstacles;
  for (const Structure& structure : plan.structures) {
    if (structure.IsObstacle()) obstacles.push_back(structure.rect);
  }
  for (const Furniture& item : furniture) {
    if (item.StandsOnFloor()) obstacles.push_back(item.Footprint());
  }
  return FreeSpace(std::move(obstacles));
}

}  // namespace dsg::simulator
