// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/find_rooms.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "ingest/rooms/clearance_rooms.h"
#include "ingest/rooms/corridor_arms.h"
#include "ingest/rooms/filtration.h"
#include "ingest/rooms/furniture.h"
#include "ingest/rooms/outline.h"
#include "ingest/rooms/place_rooms.h"
#include "ingest/rooms/section.h"

namespace dsg::ingest {
namespace {

/// Further than any room is wide.
constexpr double kFarM = 100.0;

std::vector<uint8_t> FreeCells(const OccupancyGrid& plan) {
  std::vector<uint8_t> is_free(plan.cells.size());
  for (size_t i = 0; i < is_free.size(); ++i) {
    is_free[i] = plan.cells[i] == Occupancy::kFree ? 1 : 0;
  }
  return is_free;
}

/// What both methods look at.
struct Storey {
  const RoomInput& input;
  const RoomOptions& options;
  OccupancyGrid body;
  OccupancyGrid section;
  CeilingMap ceilings;

  Storey(const RoomInput& the_input, const RoomOptions& the_options)
      : input(the_input), options(the_options) {
    const OccupancyGrid& grid = input.field->grid();
    body = BodySection(grid, input.floor_z_m, options.section);
    FillHoles(options.body_hole_m, &body);
    FreeIslands(options.furniture, &body);
    ceilings = FindCeilings(grid, input.floor_z_m, input.ceiling_z_m, options.section);
    section = CeilingSection(grid, input.floor_z_m, ceilings, options.section);
  }
};

// What nobody saw of the section is not free, but for small holes away from walls.
PlanRegions CeilingRegions(const Storey& storey) {
  OccupancyGrid section = storey.section;
  FillOccupiedFrom(storey.body, &section);
  FillHoles(storey.options.hole_m, &section);
  FreeIslands(storey.options.furniture, &section);
  PlanRegions regions = DivideAtGaps(section, storey.options, OpenRooms::kLeave).regions;
  GrowRegions(FreeCells(section), storey.options.hole_m, &regions);
  return regions;
}

// Where nobody saw the ceiling, what free space says further down: `closed` is that with its doors
// closed.
PlanRegions JoinedRegions(const Storey& storey, const OccupancyGrid& closed) {
  OccupancyGrid joined = storey.section;
  FillFrom(closed, &joined);
  FreeIslands(storey.options.furniture, &joined);
  PlanRegions regions = DivideAtGaps(joined, storey.options, OpenRooms::kLeave).regions;
  GrowRegions(FreeCells(joined), storey.options.hole_m, &regions);
  return regions;
}

// The cells around places that the filtration has put in rooms, and what is reached from them.
PlanRegions FiltrationRegions(const Storey& storey) {
  const RoomInput& input = storey.input;
  const std::vector<int> rooms =
      FiltrationRooms(input.places.size(), input.links, storey.options.filtration);
  PlanRegions regions;
  regions.frame = storey.body.frame;
  regions.region_of.assign(storey.body.cells.size(), -1);
  for (size_t i = 0; i < rooms.size(); ++i) {
    if (rooms[i] < 0) continue;
    Eigen::Vector3i cell = regions.frame.CellOf(input.places[i].position_map);
    cell.z() = 0;
    if (regions.frame.Holds(cell)) regions.region_of[regions.frame.Index(cell)] = rooms[i];
    regions.count = std::max(regions.count, rooms[i] + 1);
  }
  GrowRegions(FreeCells(storey.body), kFarM, &regions);
  return regions;
}

// The distance field as it is below the storey's ceiling, in pieces; none without a ceiling.
PlanRegions PaperRegions(const RoomInput& input, const RoomOptions& options) {
  const OccupancyGrid& grid = input.field->grid();
  GridFrame plan = grid.frame;
  plan.size.z() = 1;
  const int64_t columns = int64_t{plan.size.x()} * plan.size.y();
  std::vector<uint8_t> is_member(static_cast<size_t>(columns), 0);
  const double z_m = input.ceiling_z_m.value_or(0.0) - options.section.below_ceiling_m;
  const auto layer =
      static_cast<int>(std::floor((z_m - grid.frame.origin_map.z()) / grid.frame.cell_m));
  if (input.ceiling_z_m.has_value() && layer >= 0 && layer < grid.frame.size.z()) {
    for (int64_t i = 0; i < columns; ++i) {
      const int64_t cell = layer * columns + i;
      const bool is_far =
          input.field->DistanceM(cell) > static_cast<float>(options.section_clearance_m);
      is_member[static_cast<size_t>(i)] =
          is_far && grid.cells[static_cast<size_t>(cell)] == Occupancy::kFree ? 1 : 0;
    }
  }
  return LabelRegions(plan, is_member, /*m2_min=*/0.0);
}

double HighestFreeM(const Storey& storey, const std::vector<int64_t>& columns) {
  const OccupancyGrid& grid = storey.input.field->grid();
  const int64_t layer = int64_t{grid.frame.size.x()} * grid.frame.size.y();
  for (int z = grid.frame.size.z() - 1; z >= 0; --z) {
    for (const int64_t column : columns) {
      const auto cell = static_cast<size_t>(z * layer + column);
      if (grid.cells[cell] != Occupancy::kFree) continue;
      return grid.frame.origin_map.z() + (z + 1) * grid.frame.cell_m;
    }
  }
  return storey.input.floor_z_m;
}

// The commonest ceiling over some columns, or what the storey has, or the highest free space.
double TopOf(const Storey& storey, const std::vector<int64_t>& columns) {
  std::map<float, int64_t> counts;
  for (const int64_t column : columns) {
    const float z_m = storey.ceilings.z_m[static_cast<size_t>(column)];
    if (!std::isnan(z_m)) ++counts[z_m];
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most != counts.end()) return static_cast<double>(most->first);
  if (storey.input.ceiling_z_m.has_value()) return *storey.input.ceiling_z_m;
  return HighestFreeM(storey, columns);
}

void DescribeRooms(const Storey& storey, const PlanRegions& regions, RoomLabelling* labelling) {
  std::vector<std::vector<int64_t>> columns(static_cast<size_t>(regions.count));
  for (size_t i = 0; i < regions.region_of.size(); ++i) {
    const int region = regions.region_of[i];
    if (region >= 0) columns[static_cast<size_t>(region)].push_back(static_cast<int64_t>(i));
  }
  const std::vector<Polygon2d> outlines = OutlinesOf(regions);
  labelling->rooms.resize(columns.size());
  for (size_t i = 0; i < columns.size(); ++i) {
    FoundRoom& room = labelling->rooms[i];
    room.footprint_map = outlines[i];
    room.area_m2 = std::abs(SignedArea(outlines[i]));
    room.z_min_m = storey.input.floor_z_m;
    room.z_max_m = std::max(room.z_min_m, TopOf(storey, columns[i]));
  }
  for (size_t place = 0; place < labelling->room_of_place.size(); ++place) {
    const int room = labelling->room_of_place[place];
    if (room >= 0) {
      labelling->rooms[static_cast<size_t>(room)].places.push_back(static_cast<int>(place));
    }
  }
}

// A room that no place is in would stand alone in the graph.
void DropRoomsWithoutPlaces(const std::vector<RoomPlace>& places,
                            const std::vector<RoomLink>& links, PlanRegions* regions) {
  if (places.empty()) return;
  std::vector<bool> is_kept(static_cast<size_t>(regions->count), false);
  for (const int room : RoomsOfPlaces(places, links, *regions)) {
    if (room >= 0) is_kept[static_cast<size_t>(room)] = true;
  }
  KeepRegions(is_kept, regions);
}

RoomLabelling Label(const Storey& storey, RoomMethod method, PlanRegions regions) {
  const RoomInput& input = storey.input;
  if (storey.options.split_corridors) SplitCorridors(storey.options.corridors, &regions);
  DropRoomsWithoutPlaces(input.places, input.links, &regions);
  RoomLabelling labelling;
  labelling.method = method;
  labelling.room_of_place = RoomsOfPlaces(input.places, input.links, regions);
  GrowRegions(FreeCells(storey.body), storey.options.doorway_m, &regions);
  labelling.adjacent = AdjacentRooms(input.places, input.links, labelling.room_of_place, regions);
  CoverFurniture(storey.options.furniture, &regions);
  DescribeRooms(storey, regions, &labelling);
  return labelling;
}

// Rooms are joined where a link joins their places.
RoomLabelling LabelAsPaper(const Storey& storey) {
  const RoomInput& input = storey.input;
  PlanRegions regions = PaperRegions(input, storey.options);
  DropRoomsWithoutPlaces(input.places, input.links, &regions);
  RoomLabelling labelling;
  labelling.method = RoomMethod::kPaper;
  labelling.room_of_place = RoomsOfPlaces(input.places, input.links, regions);
  labelling.adjacent = LinkedRooms(input.links, labelling.room_of_place);
  DescribeRooms(storey, regions, &labelling);
  return labelling;
}

RoomResult FindByBoth(const Storey& storey) {
  RoomResult result;
  const DividedPlan clearance = ClearanceRegions(storey.body, storey.options);
  const PlanRegions joined = JoinedRegions(storey, clearance.closed);
  const bool saw_ceiling = storey.ceilings.seen_share >= storey.options.ceiling_seen_share;
  result.best = Label(storey, saw_ceiling ? RoomMethod::kCeiling : RoomMethod::kClearance, joined);
  RoomLabelling other = Label(storey, RoomMethod::kClearance, clearance.regions);
  if (Disagreement(result.best.room_of_place, other.room_of_place) >
      storey.options.other_word_min) {
    result.alternative = std::move(other);
  }
  return result;
}

}  // namespace

RoomResult FindRooms(const RoomInput& input, const RoomOptions& options) {
  if (input.field == nullptr || input.field->grid().cells.empty()) {
    RoomResult nothing;
    nothing.best.room_of_place.assign(input.places.size(), -1);
    return nothing;
  }
  const Storey storey(input, options);
  switch (options.method) {
    case RoomMethod::kCeiling:
      return {Label(storey, RoomMethod::kCeiling, CeilingRegions(storey)), std::nullopt};
    case RoomMethod::kClearance:
      return {Label(storey, RoomMethod::kClearance, ClearanceRegions(storey.body, options).regions),
              std::nullopt};
    case RoomMethod::kFiltration:
      return {Label(storey, RoomMethod::kFiltration, FiltrationRegions(storey)), std::nullopt};
    case RoomMethod::kPaper:
      return {LabelAsPaper(storey), std::nullopt};
    case RoomMethod::kAuto:
      break;
  }
  return FindByBoth(storey);
}

}  // namespace dsg::ingest
