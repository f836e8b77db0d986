// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/floor_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"

namespace dsg::simulator {
namespace {

// A door's frame keeps this far from the corners of its room.
constexpr double kDoorCornerM = 0.4;

double Centimetres(double metres) { return std::round(metres * 100.0) / 100.0; }

struct Lot {
  std::string class_name;
  double width_m;
};

// Half of the shuffled rooms to each side of the spine, both stretched to the same length.
std::pair<std::vector<Lot>, std::vector<Lot>> DrawLots(const PlanSpec& spec, Random* random) {
  std::vector<Lot> lots;
  for (const RoomSpec& room : spec.rooms) {
    for (int i = 0; i < room.count; ++i) {
      lots.push_back({room.class_name, random->Uniform(room.width_m_min, room.width_m_max)});
    }
  }
  for (size_t i = lots.size() - 1; i > 0; --i) {
    std::swap(lots[i], lots[random->Index(static_cast<int>(i) + 1)]);
  }
  const auto middle = lots.begin() + static_cast<ptrdiff_t>(lots.size() / 2);
  std::vector<Lot> south(lots.begin(), middle);
  std::vector<Lot> north(middle, lots.end());
  const auto width = [](const std::vector<Lot>& side) {
    double sum = 0.0;
    for (const Lot& lot : side) sum += lot.width_m;
    return sum;
  };
  const double length = Centimetres(0.5 * (width(south) + width(north)));
  for (std::vector<Lot>* side : {&south, &north}) {
    const double stretch = length / width(*side);
    for (Lot& lot : *side) lot.width_m *= stretch;
  }
  return {south, north};
}

// One row of rooms between y_min and y_max, each with a door on the line y_door.
void AddRow(const std::vector<Lot>& lots, double length, double y_min, double y_max, double y_door,
            double door_width, Random* random, FloorPlan* plan) {
  double exact_x = 0.0;
  double x_min = 0.0;
  for (size_t i = 0; i < lots.size(); ++i) {
    exact_x += lots[i].width_m;
    const double x_max = i + 1 == lots.size() ? length : Centimetres(exact_x);
    const double reach = kHalfWallM + kDoorCornerM + 0.5 * door_width;
    const double x_door = Centimetres(random->Uniform(x_min + reach, x_max - reach));
    plan->doors.push_back(
        {static_cast<int>(plan->rooms.size()), Point(x_door, y_door), door_width});
    plan->rooms.push_back({lots[i].class_name, "", Rect(Point(x_min, y_min), Point(x_max, y_max))});
    x_min = x_max;
  }
}

void NameRooms(FloorPlan* plan) {
  std::map<std::string, int> count;
  for (const Room& room : plan->rooms) ++count[room.class_name];
  std::map<std::string, int> next;
  for (Room& room : plan->rooms) {
    room.name = count[room.class_name] == 1
                    ? room.class_name
                    : absl::StrCat(room.class_name, " ", ++next[room.class_name]);
  }
}

struct Side {
  /// Into the room.
  Point normal;
  Rect rect;
};

std::vector<Side> SidesOf(const Room& room) {
  const Rect& cell = room.cell;
  const Rect inside = room.Interior();
  return {
      {Point(0, 1), Rect(cell.min(), Point(cell.max().x(), inside.min().y()))},
      {Point(0, -1), Rect(Point(cell.min().x(), inside.max().y()), cell.max())},
      {Point(1, 0), Rect(cell.min(), Point(inside.min().x(), cell.max().y()))},
      {Point(-1, 0), Rect(Point(inside.max().x(), cell.min().y()), cell.max())},
  };
}

void AddWall(const FloorPlan& plan, int room, const Side& side, const Rect& rect, double z_min,
             std::vector<Structure>* out) {
  const Rect inside = plan.rooms[room].Interior();
  const Point face(side.normal.x() > 0 ? inside.min().x() : inside.max().x(),
                   side.normal.y() > 0 ? inside.min().y() : inside.max().y());
  out->push_back({"wall", room, rect, z_min, plan.ceiling_m,
                  Eigen::Vector3d(side.normal.x(), side.normal.y(), 0.0), -side.normal.dot(face)});
}

// Pieces of wall between the doors, and a lintel over each.
void AddSide(const FloorPlan& plan, int room, const Side& side, std::vector<Structure>* out) {
  std::vector<Rect> openings;
  if (side.normal.y() != 0.0) {
    for (const Door& door : plan.doors) {
      const Rect opening = door.Opening().intersection(side.rect);
      const bool of_room = room == 0 || door.room == room;
      if (of_room && !opening.isEmpty() && opening.sizes().minCoeff() > 0.0) {
        openings.push_back(opening);
      }
    }
  }
  std::sort(openings.begin(), openings.end(),
            [](const Rect& a, const Rect& b) { return a.min().x() < b.min().x(); });
  Point begin = side.rect.min();
  for (const Rect& opening : openings) {
    AddWall(plan, room, side, Rect(begin, Point(opening.min().x(), side.rect.max().y())), 0.0, out);
    AddWall(plan, room, side, opening, kDoorHeightM, out);
    begin.x() = opening.max().x();
  }
  AddWall(plan, room, side, Rect(begin, side.rect.max()), 0.0, out);
}

std::vector<Structure> DrawStructures(const FloorPlan& plan) {
  constexpr double kSlabM = 0.1;
  std::vector<Structure> structures;
  for (int room = 0; room < static_cast<int>(plan.rooms.size()); ++room) {
    for (const Side& side : SidesOf(plan.rooms[room])) AddSide(plan, room, side, &structures);
    const Rect& cell = plan.rooms[room].cell;
    structures.push_back({"floor", room, cell, -kSlabM, 0.0, Eigen::Vector3d::UnitZ(), 0.0});
    structures.push_back({"ceiling", room, cell, plan.ceiling_m, plan.ceiling_m + kSlabM,
                          Eigen::Vector3d(0.0, 0.0, -1.0), plan.ceiling_m});
  }
  return structures;
}

}  // namespace

int FloorPlan::RoomAt(const Point& point) const {
  for (size_t i = 0; i < rooms.size(); ++i) {
    if (rooms[i].Contains(point)) return static_cast<int>(i);
  }
  return -1;
}

FloorPlan DrawFloorPlan(const PlanSpec& spec, Random* random) {
  const auto [south, north] = DrawLots(spec, random);
  double exact_length = 0.0;
  for (const Lot& lot : south) exact_length += lot.width_m;
  const double length = Centimetres(exact_length);
  const auto draw_depth = [&] {
    return Centimetres(random->Uniform(spec.room_depth_m_min, spec.room_depth_m_max));
  };
  const double y_spine = draw_depth();
  const double y_north = Centimetres(y_spine + spec.spine_width_m);
  const double y_end = Centimetres(y_north + draw_depth());

  FloorPlan plan;
  plan.building_name = spec.building_name;
  plan.ceiling_m = spec.ceiling_m;
  plan.rooms.push_back({spec.spine_class, "", Rect(Point(0, y_spine), Point(length, y_north))});
  AddRow(south, length, 0.0, y_spine, y_spine, spec.door_width_m, random, &plan);
  AddRow(north, length, y_north, y_end, y_north, spec.door_width_m, random, &plan);
  NameRooms(&plan);
  plan.structures = DrawStructures(plan);
  return plan;
}

}  // namespace dsg::simulator
