// SPDX-License-Identifier: Apache-2.0
// Rooms for the cells of a partition, ways between them, glass and pillars.
#include <algorithm>
#include <cmath>
#include <optional>

#include "ingest/simulator/world/floor_plan.h"
#include "ingest/simulator/world/partition.h"
#include "ingest/simulator/world/shell.h"
#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

constexpr double kCeilingM = 3.0;
constexpr double kLowCeilingM = 2.7;
/// Openings and glass keep this far from the corners of their wall.
constexpr double kCornerM = kHalfWallM + 0.4;
constexpr double kDoorWidthMinM = 0.9;
constexpr double kDoorWidthMaxM = 1.0;
constexpr double kWideMinM = 1.2;
constexpr double kWideMaxM = 2.4;
constexpr double kFullHeightShare = 0.11;
constexpr double kGlassShare = 0.06;
constexpr double kInnerDoorShare = 0.08;

/// One office being drawn.
class OfficeDraft {
 public:
  explicit OfficeDraft(Random* random) : random_(random) {}

  std::optional<FloorPlan> Draw() {
    if (!DrawRooms() || !ChooseWays()) return std::nullopt;
    AssignClasses();
    for (const int wall : ways_) AddOpening(walls_[wall]);
    AddGlass();
    AddPillars();
    plan_.building_name = "office";
    plan_.ceiling_m = kCeilingM;
    NameRooms(&plan_.rooms);
    plan_.structures = DrawShell(plan_.rooms, plan_.doors, glass_, pillars_);
    return std::move(plan_);
  }

 private:
  bool DrawRooms() {
    const std::optional<Partition> partition = DrawPartition(random_);
    if (!partition) return false;
    std::vector<Rect> cells;
    const auto add = [&](const Rect& cell, const char* class_name, double ceiling_m) {
      cells.push_back(cell);
      const bool is_passage = std::string(class_name) == "corridor";
      plan_.rooms.push_back({class_name, "", cell, ceiling_m, is_passage});
    };
    for (const Rect& cell : partition->corridors) add(cell, "corridor", kCeilingM);
    first_hall_ = static_cast<int>(cells.size());
    for (const Rect& cell : partition->halls) add(cell, "open office", kCeilingM);
    first_room_ = static_cast<int>(cells.size());
    for (const Rect& cell : partition->rooms) {
      add(cell, "", random_->Chance(0.25) ? kLowCeilingM : kCeilingM);
    }
    walls_ = SharedWallsOf(cells);
    return true;
  }

  bool IsCorridor(int room) const { return room < first_hall_; }
  bool IsHall(int room) const { return room >= first_hall_ && room < first_room_; }
  double AreaOf(int room) const { return plan_.rooms[room].cell.volume(); }
  static bool HasSpaceForDoor(const SharedWall& wall) {
    return wall.length_m() >= kDoorWidthMaxM + 2.0 * kCornerM;
  }

  /// Walls of a room wide enough for a door to a room that `accepts`.
  template <typename Accepts>
  std::vector<int> WallsTo(int room, const Accepts& accepts) const {
    std::vector<int> found;
    for (int i = 0; i < static_cast<int>(walls_.size()); ++i) {
      const SharedWall& wall = walls_[i];
      if ((wall.a != room && wall.b != room) || !HasSpaceForDoor(wall)) continue;
      if (accepts(wall.a == room ? wall.b : wall.a)) found.push_back(i);
    }
    return found;
  }

  void AddWay(int wall) {
    if (std::find(ways_.begin(), ways_.end(), wall) == ways_.end()) ways_.push_back(wall);
  }

  int Any(const std::vector<int>& choices) {
    return choices[random_->Index(static_cast<int>(choices.size()))];
  }

  /// A way from every room to a corridor, over another room at most. False when one has none.
  bool ChooseWays() {
    for (int i = 0; i < static_cast<int>(walls_.size()); ++i) {
      if (IsCorridor(walls_[i].a) && IsCorridor(walls_[i].b)) AddWay(i);
    }
    const auto is_corridor = [&](int room) { return IsCorridor(room); };
    const int count = static_cast<int>(plan_.rooms.size());
    is_at_corridor_.assign(plan_.rooms.size(), false);
    is_host_.assign(plan_.rooms.size(), false);
    for (int room = first_hall_; room < count; ++room) {
      const std::vector<int> walls = WallsTo(room, is_corridor);
      if (walls.empty()) continue;
      is_at_corridor_[room] = true;
      AddWay(Any(walls));
      // Halls are entered from several sides.
      for (int i = 0; IsHall(room) && i < 1 + static_cast<int>(AreaOf(room) / 120.0); ++i) {
        AddWay(Any(walls));
      }
    }
    for (int room = first_hall_; room < count; ++room) {
      if (is_at_corridor_[room]) continue;
      const std::vector<int> walls =
          WallsTo(room, [&](int other) { return is_at_corridor_[other]; });
      if (walls.empty()) return false;
      AddWay(Any(walls));
      const SharedWall& wall = walls_[ways_.back()];
      is_host_[wall.a == room ? wall.b : wall.a] = true;
    }
    for (int i = 0; i < static_cast<int>(walls_.size()); ++i) {
      if (IsCorridor(walls_[i].a) || !HasSpaceForDoor(walls_[i])) continue;
      if (!random_->Chance(kInnerDoorShare)) continue;
      AddWay(i);
      is_host_[walls_[i].a] = is_host_[walls_[i].b] = true;
    }
    return true;
  }

  /// Gives the class to up to `count` of the rooms that have none, in the order of `rooms`.
  template <typename Accepts>
  void Assign(const char* class_name, int count, const std::vector<int>& rooms,
              const Accepts& accepts) {
    for (const int room : rooms) {
      if (count == 0) return;
      if (!plan_.rooms[room].class_name.empty() || !accepts(room)) continue;
      plan_.rooms[room].class_name = class_name;
      --count;
    }
  }

  void AssignClasses() {
    std::vector<int> rooms;
    for (int room = first_room_; room < static_cast<int>(plan_.rooms.size()); ++room) {
      rooms.push_back(room);
    }
    for (size_t i = rooms.size() - 1; i > 0; --i) {
      std::swap(rooms[i], rooms[random_->Index(static_cast<int>(i) + 1)]);
    }
    // Nobody passes through a service room, so it is none of the hosts.
    const auto is_service = [&](int room) { return !is_host_[room] && AreaOf(room) <= 32.0; };
    const auto within = [&](double low, double high) {
      return [this, low, high](int room) { return AreaOf(room) >= low && AreaOf(room) <= high; };
    };
    const auto is_open_to_all = [&](int room) { return is_service(room) && is_at_corridor_[room]; };
    Assign("restroom", 3, rooms, is_open_to_all);
    Assign("copy room", 2, rooms, is_service);
    Assign("storage room", 2, rooms, is_service);
    Assign("kitchen", 2, rooms, within(16.0, 50.0));
    Assign("library", 1, rooms, within(34.0, 60.0));
    Assign("lounge", 2, rooms, within(24.0, 60.0));
    Assign("meeting room", static_cast<int>(rooms.size()) / 5, rooms, within(18.0, 60.0));
    Assign("office", static_cast<int>(rooms.size()), rooms, within(0.0, 60.0));
    // One hall is where people arrive.
    if (first_room_ > first_hall_) {
      const int lobby = first_hall_ + random_->Index(first_room_ - first_hall_);
      plan_.rooms[lobby].class_name = "lobby";
    }
  }

  void AddOpening(const SharedWall& wall) {
    Door door;
    door.room_a = wall.a;
    door.room_b = wall.b;
    door.walks_along_y = wall.runs_along_x;
    if (IsCorridor(wall.a) && IsCorridor(wall.b)) {
      // The whole width of the corridor that ends here.
      door.kind = OpeningKind::kFullHeight;
      door.width_m = wall.length_m() - 2.0 * kHalfWallM;
      door.center = wall.At(0.5 * (wall.from_m + wall.to_m));
      plan_.doors.push_back(door);
      return;
    }
    const double space = wall.length_m() - 2.0 * kCornerM;
    door.width_m = Centimetres(random_->Uniform(kDoorWidthMinM, kDoorWidthMaxM));
    const bool is_wide = random_->Chance(kFullHeightShare) && MayBeWide(wall.b);
    if (is_wide && space >= kWideMinM) {
      door.kind = OpeningKind::kFullHeight;
      door.width_m = Centimetres(random_->Uniform(kWideMinM, std::min(kWideMaxM, space)));
    }
    const double reach = kCornerM + 0.5 * door.width_m;
    door.center = wall.At(Centimetres(random_->Uniform(wall.from_m + reach, wall.to_m - reach)));
    plan_.doors.push_back(door);
  }

  bool MayBeWide(int room) const {
    const std::string& name = plan_.rooms[room].class_name;
    return name != "restroom" && name != "storage room";
  }

  /// The wall from corner to corner, apart from a door.
  void AddGlassFront(const SharedWall& wall) {
    constexpr double kFrameM = 0.1;
    constexpr double kPaneMinM = 0.8;
    double begin = wall.from_m + kCornerM;
    const auto add_until = [&](double end) {
      if (end - begin < kPaneMinM) return;
      const Point low = wall.At(begin);
      const Point high = wall.At(end);
      const Point half = wall.runs_along_x ? Point(0.0, kHalfWallM) : Point(kHalfWallM, 0.0);
      glass_.push_back({wall.a, wall.b, Rect(low - half, high + half)});
    };
    for (const Door& door : plan_.doors) {
      if (door.room_a != wall.a || door.room_b != wall.b) continue;
      const double along = wall.runs_along_x ? door.center.x() : door.center.y();
      add_until(along - 0.5 * door.width_m - kFrameM);
      begin = along + 0.5 * door.width_m + kFrameM;
    }
    add_until(wall.to_m - kCornerM);
  }

  void AddGlass() {
    std::vector<int> fronts;
    for (int i = 0; i < static_cast<int>(walls_.size()); ++i) {
      const SharedWall& wall = walls_[i];
      if (IsCorridor(wall.a) && !IsCorridor(wall.b) && MayBeWide(wall.b) &&
          wall.length_m() >= 3.0) {
        fronts.push_back(i);
      }
    }
    int count = 0;
    for (const int front : fronts) {
      if (!random_->Chance(kGlassShare)) continue;
      AddGlassFront(walls_[front]);
      ++count;
    }
    if (count == 0) AddGlassFront(walls_[Any(fronts)]);
  }

  void AddPillars() {
    constexpr double kPillarM = 0.4;
    constexpr double kSpacingM = 5.5;
    constexpr double kDoorGapM = 1.5;
    for (int hall = first_hall_; hall < first_room_; ++hall) {
      const Rect& cell = plan_.rooms[hall].cell;
      const auto count = [](double edge) { return std::max(1.0, std::floor(edge / kSpacingM)); };
      const Point counts(count(cell.sizes().x()), count(cell.sizes().y()));
      for (double row = 1; row <= counts.y(); ++row) {
        for (double column = 1; column <= counts.x(); ++column) {
          const Point share(column / (counts.x() + 1), row / (counts.y() + 1));
          const Point at = cell.min() + cell.sizes().cwiseProduct(share);
          const Point middle(Centimetres(at.x()), Centimetres(at.y()));
          const Rect rect = Inflate(Rect(middle, middle), 0.5 * kPillarM);
          const bool is_at_door =
              std::any_of(plan_.doors.begin(), plan_.doors.end(), [&](const Door& door) {
                return Inflate(door.Opening(), kDoorGapM).intersects(rect);
              });
          if (!is_at_door) pillars_.push_back({hall, rect});
        }
      }
    }
  }

  Random* const random_;
  FloorPlan plan_;
  /// Rooms are sorted: corridors, halls from here, rooms from there.
  int first_hall_ = 0;
  int first_room_ = 0;
  std::vector<SharedWall> walls_;
  /// Indices of the walls that get an opening.
  std::vector<int> ways_;
  /// Whether a door leads from it to a corridor.
  std::vector<bool> is_at_corridor_;
  /// One passes through it to reach another room.
  std::vector<bool> is_host_;
  std::vector<GlassFront> glass_;
  std::vector<Pillar> pillars_;
};

}  // namespace

FloorPlan DrawOfficePlan(Random* random) {
  // Most draws come out, and each takes well below a millisecond.
  constexpr int kDrawCountMax = 1000;
  for (int i = 0; i < kDrawCountMax; ++i) {
    std::optional<FloorPlan> plan = OfficeDraft(random).Draw();
    if (plan) return *std::move(plan);
  }
  DSG_CHECK(false && "no office came out of a thousand draws");
  return {};
}

}  // namespace dsg::simulator
