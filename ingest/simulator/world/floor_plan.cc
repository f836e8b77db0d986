// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/floor_plan.h"

#include <algorithm>
#include <utility>

#include "ingest/simulator/world/shell.h"

namespace dsg::simulator {
namespace {

// A door's frame keeps this far from the corners of its room.
constexpr double kDoorCornerM = 0.4;
// No room is stretched by more than this share to make both sides equally long.
constexpr double kStretchMax = 1.25;

struct Lot {
  std::string class_name;
  double width_m;
};

double WidthOf(const std::vector<Lot>& side) {
  double sum = 0.0;
  for (const Lot& lot : side) sum += lot.width_m;
  return sum;
}

// Half of the shuffled rooms to each side of the spine, both stretched to the same length.
std::pair<std::vector<Lot>, std::vector<Lot>> DrawLots(const PlanSpec& spec, Random* random) {
  std::vector<Lot> lots;
  for (const RoomSpec& room : spec.rooms) {
    for (int i = 0; i < room.count; ++i) {
      lots.push_back({room.class_name, random->Uniform(room.width_m_min, room.width_m_max)});
    }
  }
  std::vector<Lot> south;
  std::vector<Lot> north;
  double length = 0.0;
  do {
    for (size_t i = lots.size() - 1; i > 0; --i) {
      std::swap(lots[i], lots[random->Index(static_cast<int>(i) + 1)]);
    }
    const auto middle = lots.begin() + static_cast<ptrdiff_t>(lots.size() / 2);
    south.assign(lots.begin(), middle);
    north.assign(middle, lots.end());
    length = Centimetres(0.5 * (WidthOf(south) + WidthOf(north)));
  } while (length > kStretchMax * std::min(WidthOf(south), WidthOf(north)));
  for (std::vector<Lot>* side : {&south, &north}) {
    const double stretch = length / WidthOf(*side);
    for (Lot& lot : *side) lot.width_m *= stretch;
  }
  return {south, north};
}

// One row of rooms between y_min and y_max, each with a door to the spine on the line y_door.
void AddRow(const PlanSpec& spec, const std::vector<Lot>& lots, double length, double y_min,
            double y_max, double y_door, Random* random, FloorPlan* plan) {
  double exact_x = 0.0;
  double x_min = 0.0;
  for (size_t i = 0; i < lots.size(); ++i) {
    exact_x += lots[i].width_m;
    const double x_max = i + 1 == lots.size() ? length : Centimetres(exact_x);
    const double reach = kHalfWallM + kDoorCornerM + 0.5 * spec.door_width_m;
    const double x_door = Centimetres(random->Uniform(x_min + reach, x_max - reach));
    plan->doors.push_back({0, static_cast<int>(plan->rooms.size()), Point(x_door, y_door),
                           spec.door_width_m, true, OpeningKind::kDoor});
    plan->rooms.push_back({lots[i].class_name, "", Rect(Point(x_min, y_min), Point(x_max, y_max)),
                           spec.ceiling_m, false});
    x_min = x_max;
  }
}

}  // namespace

int FloorPlan::RoomAt(const Point& point) const {
  for (size_t i = 0; i < rooms.size(); ++i) {
    if (rooms[i].Contains(point)) return static_cast<int>(i);
  }
  return -1;
}

FloorPlan DrawSpinePlan(const PlanSpec& spec, Random* random) {
  const auto [south, north] = DrawLots(spec, random);
  const double length = Centimetres(WidthOf(south));
  const auto draw_depth = [&] {
    return Centimetres(random->Uniform(spec.room_depth_m_min, spec.room_depth_m_max));
  };
  const double y_spine = draw_depth();
  const double y_north = Centimetres(y_spine + spec.spine_width_m);
  const double y_end = Centimetres(y_north + draw_depth());

  FloorPlan plan;
  plan.building_name = spec.building_name;
  plan.ceiling_m = spec.ceiling_m;
  plan.rooms.push_back({spec.spine_class, "", Rect(Point(0, y_spine), Point(length, y_north)),
                        spec.ceiling_m, true});
  AddRow(spec, south, length, 0.0, y_spine, y_spine, random, &plan);
  AddRow(spec, north, length, y_north, y_end, y_north, random, &plan);
  NameRooms(&plan.rooms);
  plan.structures = DrawShell(plan.rooms, plan.doors, {}, {});
  return plan;
}

}  // namespace dsg::simulator
