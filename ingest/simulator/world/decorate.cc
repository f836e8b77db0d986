// SPDX-License-Identifier: Apache-2.0
// What hangs on walls and lies on tables.
#include <algorithm>
#include <map>

#include "ingest/simulator/world/catalogue.h"
#include "ingest/simulator/world/furnish.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {
namespace {

constexpr int kPieceTryCount = 20;

Box3d BoxOf(const Furniture& item) {
  const Rect footprint = item.Footprint();
  const double half = 0.5 * item.size.z();
  return Box3d(Eigen::Vector3d(footprint.min().x(), footprint.min().y(), item.center.z() - half),
               Eigen::Vector3d(footprint.max().x(), footprint.max().y(), item.center.z() + half));
}

Furniture MakePiece(const char* class_name, int room, const Eigen::Vector3d& size, Random* random) {
  Furniture item;
  item.class_name = class_name;
  item.room = room;
  item.size = size;
  const std::vector<Color> colors = ColorsOf(class_name);
  item.color = colors[random->Index(static_cast<int>(colors.size()))];
  return item;
}

/// Quarter turns that make a piece's front look along an axis.
int TurnsToward(const Eigen::Vector3d& normal) {
  if (normal.y() > 0.5) return 0;
  if (normal.x() < -0.5) return 1;
  return normal.y() < -0.5 ? 2 : 3;
}

class Decorator {
 public:
  Decorator(const FloorPlan& plan, Random* random, std::vector<Furniture>* all)
      : plan_(plan), random_(random), all_(all), room_items_(plan.rooms.size()) {
    for (size_t i = 0; i < all->size(); ++i) Note(i);
  }

  void Hang(int room) {
    std::vector<const Structure*> walls;
    for (const Structure& part : plan_.structures) {
      // Not over a door, where a piece of wall hangs itself.
      if (part.room == room && part.type == "wall" && part.z_min_m == 0.0) walls.push_back(&part);
    }
    for (const HungCount& entry : HungOf(plan_.rooms[room].class_name)) {
      const int count = random_->Integer(entry.min, entry.max);
      for (int i = 0; i < count; ++i) HangOne(room, entry.piece, walls);
    }
  }

  void LayOut(int room) {
    // A copy: what is added here carries nothing.
    const std::vector<size_t> carriers = room_items_[room];
    for (const size_t carrier : carriers) {
      for (const LooseItem& loose : LooseItems()) {
        if ((*all_)[carrier].class_name != loose.on_class) continue;
        if (random_->Chance(loose.probability)) LayOne(room, carrier, loose);
      }
    }
  }

 private:
  void Note(size_t index) {
    room_items_[(*all_)[index].room].push_back(index);
    ++class_count_[(*all_)[index].class_name];
  }

  bool IsFree(const Furniture& item, double gap_m) const {
    const Box3d box = BoxOf(item);
    const Eigen::Vector3d gap = Eigen::Vector3d(gap_m, gap_m, 0.0);
    const Box3d reach(box.min() - gap, box.max() + gap);
    return std::none_of(
        room_items_[item.room].begin(), room_items_[item.room].end(), [&](size_t other) {
          // What it stands on touches it from below.
          return static_cast<int>(other) != item.on && reach.intersects(BoxOf((*all_)[other]));
        });
  }

  void Add(const Furniture& item) {
    if (class_count_[item.class_name] >= kPiecesOfClassMax) return;
    all_->push_back(item);
    Note(all_->size() - 1);
  }

  void HangOne(int room, const HungPiece& piece, const std::vector<const Structure*>& walls) {
    constexpr double kOffWallM = 0.005;
    constexpr double kEdgeM = 0.25;
    constexpr double kGapM = 0.1;
    Furniture item =
        MakePiece(piece.class_name, room, {piece.size_u, piece.size_v, piece.size_z}, random_);
    for (int i = 0; i < kPieceTryCount; ++i) {
      const Structure& wall = *walls[random_->Index(static_cast<int>(walls.size()))];
      const int along = std::abs(wall.normal.x()) > 0.5 ? 1 : 0;
      const Rect inside = wall.rect.intersection(plan_.rooms[room].cell);
      const double reach = kHalfWallM + kEdgeM + 0.5 * piece.size_u;
      const double low = inside.min()[along] + reach;
      const double high = inside.max()[along] - reach;
      if (low >= high) continue;
      const double off = kOffWallM + 0.5 * piece.size_v - wall.offset_m;
      Point at = off * wall.normal.head<2>();
      at[along] = random_->Uniform(low, high);
      item.center = Eigen::Vector3d(at.x(), at.y(), piece.base_m + 0.5 * piece.size_z);
      item.quarter_turns = TurnsToward(wall.normal);
      if (!IsFree(item, kGapM)) continue;
      Add(item);
      return;
    }
  }

  void LayOne(int room, size_t carrier, const LooseItem& loose) {
    constexpr double kEdgeM = 0.05;
    constexpr double kGapM = 0.03;
    const Furniture under = (*all_)[carrier];
    Furniture item =
        MakePiece(loose.class_name, room, {loose.size_u, loose.size_v, loose.size_z}, random_);
    item.on = static_cast<int>(carrier);
    const double top = under.center.z() + 0.5 * under.size.z();
    for (int i = 0; i < kPieceTryCount; ++i) {
      item.quarter_turns = random_->Index(4);
      const Rect inside =
          Inflate(under.Footprint(), -kEdgeM - 0.5 * item.size.head<2>().maxCoeff());
      const Point share(random_->Uniform(), random_->Uniform());
      const Point at = inside.min() + inside.sizes().cwiseProduct(share);
      item.center = Eigen::Vector3d(at.x(), at.y(), top + 0.5 * item.size.z());
      if (!IsFree(item, kGapM)) continue;
      Add(item);
      return;
    }
  }

  const FloorPlan& plan_;
  Random* const random_;
  std::vector<Furniture>* const all_;
  std::vector<std::vector<size_t>> room_items_;
  std::map<std::string, int> class_count_;
};

}  // namespace

void Decorate(const FloorPlan& plan, Random* random, std::vector<Furniture>* furniture) {
  Decorator decorator(plan, random, furniture);
  for (int room = 0; room < static_cast<int>(plan.rooms.size()); ++room) {
    decorator.Hang(room);
    decorator.LayOut(room);
  }
}

}  // namespace dsg::simulator
