// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/rooms/rooms_test_util.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "ingest/rooms/wall_gaps.h"
#include "schema/base/check.h"
#include "schema/base/random.h"
#include "schema/picture/raster.h"

namespace dsg::ingest {
namespace {

constexpr double kBelowFloorM = 0.3;
/// Edges on a cell's edge do not reach into the next cell.
constexpr double kHairM = 1e-6;

OccupancyGrid MakeGrid(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double top_m,
                       Occupancy state) {
  OccupancyGrid grid;
  grid.frame.cell_m = kCellM;
  const Eigen::Vector3d low_map(low.x(), low.y(), -kBelowFloorM);
  const Eigen::Vector3d high_map(high.x(), high.y(), top_m);
  const Eigen::Array3d first = (low_map / kCellM).array().floor();
  grid.frame.origin_map = kCellM * first.matrix();
  grid.frame.size = ((high_map / kCellM).array().ceil() - first).cast<int>();
  grid.cells.assign(static_cast<size_t>(grid.frame.CellCount()), state);
  return grid;
}

void SetBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Occupancy state,
            OccupancyGrid* grid) {
  const Eigen::Vector3d hair = Eigen::Vector3d::Constant(kHairM);
  const Eigen::Vector3i first = grid->frame.CellOf(low + hair).cwiseMax(Eigen::Vector3i::Zero());
  const Eigen::Vector3i last =
      grid->frame.CellOf(high - hair).cwiseMin(grid->frame.size - Eigen::Vector3i::Ones());
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        grid->cells[static_cast<size_t>(grid->frame.Index({x, y, z}))] = state;
      }
    }
  }
}

Eigen::Vector3d Lift(const Eigen::Vector2d& point, double z_m) {
  return {point.x(), point.y(), z_m};
}

// Where a body can be; the floor is at zero.
OccupancyGrid PlanOf(const OccupancyGrid& grid) {
  return grid.frame.size.z() == 1 ? grid : ProjectToFloor(grid, 0.0, {});
}

truth::FreeGrid FreeGridOf(const simulator::World& world, const OccupancyGrid& grid) {
  const OccupancyGrid plan = PlanOf(grid);
  truth::FreeGrid free;
  free.origin_map = plan.frame.origin_map.head<2>();
  free.cell_m = plan.frame.cell_m;
  free.width = plan.frame.size.x();
  free.height = plan.frame.size.y();
  free.cells.assign(plan.cells.size(), 0);
  for (int64_t i = 0; i < plan.frame.CellCount(); ++i) {
    const auto cell = static_cast<size_t>(i);
    if (plan.cells[cell] == Occupancy::kFree) {
      free.cells[cell] = truth::kCellFree | truth::kCellObserved;
    }
    const Eigen::Vector2d at = plan.frame.Center(plan.frame.Cell(i)).head<2>();
    for (const simulator::Door& door : world.plan.doors) {
      constexpr double kBandM = 0.4;
      if ((door.center - at).cwiseAbs().maxCoeff() > 2.0 + 0.5 * door.width_m) continue;
      if (simulator::DistanceToRect(at, door.Opening()) <= kBandM) {
        free.cells[cell] |= truth::kCellDoorBand;
      }
    }
  }
  return free;
}

dsg::picture::Paint RoomPaint(int room, float opacity) {
  constexpr uint32_t kColors[] = {0xE6194B, 0x3CB44B, 0xFFE119, 0x4363D8, 0xF58231, 0x911EB4,
                                  0x42D4F4, 0xF032E6, 0xBFEF45, 0xFABED4, 0x469990, 0xDCBEFF,
                                  0x9A6324, 0x800000, 0xAAFFC3, 0x808000, 0x000075, 0xA9A9A9};
  return dsg::picture::MakePaint(kColors[static_cast<size_t>(room) % std::size(kColors)], opacity);
}

}  // namespace

DrawnStorey::DrawnStorey(double width_m, double depth_m, double ceiling_m)
    : grid_(MakeGrid({0.0, 0.0}, {width_m, depth_m}, ceiling_m + 0.5, Occupancy::kOccupied)),
      ceiling_m_(ceiling_m) {}

void DrawnStorey::Carve(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                        std::optional<double> top_m) {
  Set(Lift(low, 0.0), Lift(high, top_m.value_or(ceiling_m_)), Occupancy::kFree);
}

void DrawnStorey::Fill(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double bottom_m,
                       double top_m) {
  Set(Lift(low, bottom_m), Lift(high, top_m), Occupancy::kOccupied);
}

void DrawnStorey::Hide(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double bottom_m,
                       double top_m) {
  Set(Lift(low, bottom_m), Lift(high, top_m), Occupancy::kUnknown);
}

void DrawnStorey::Set(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Occupancy state) {
  SetBox(low, high, state, &grid_);
}

OccupancyGrid GridOfWorld(const simulator::World& world) {
  const simulator::Rect bounds = simulator::Inflate(world.Bounds(), 0.3);
  OccupancyGrid grid =
      MakeGrid(bounds.min(), bounds.max(), world.plan.ceiling_m + 0.4, Occupancy::kUnknown);
  for (const simulator::Room& room : world.plan.rooms) {
    SetBox(Lift(room.cell.min(), 0.0), Lift(room.cell.max(), room.ceiling_m), Occupancy::kFree,
           &grid);
    SetBox(Lift(room.cell.min(), -kCellM), Lift(room.cell.max(), 0.0), Occupancy::kOccupied, &grid);
    SetBox(Lift(room.cell.min(), room.ceiling_m), Lift(room.cell.max(), room.ceiling_m + kCellM),
           Occupancy::kOccupied, &grid);
  }
  for (const simulator::Structure& piece : world.plan.structures) {
    if (piece.type == "floor" || piece.type == "ceiling") continue;
    SetBox(Lift(piece.rect.min(), piece.z_min_m), Lift(piece.rect.max(), piece.z_max_m),
           Occupancy::kOccupied, &grid);
  }
  for (const simulator::Furniture& item : world.furniture) {
    const simulator::Rect rect = item.Footprint();
    SetBox(Lift(rect.min(), item.BaseM()), Lift(rect.max(), item.BaseM() + item.size.z()),
           Occupancy::kOccupied, &grid);
  }
  return grid;
}

void HideAbove(double height_m, OccupancyGrid* grid) {
  for (int64_t i = 0; i < grid->frame.CellCount(); ++i) {
    if (grid->frame.Center(grid->frame.Cell(i)).z() > height_m) {
      grid->cells[static_cast<size_t>(i)] = Occupancy::kUnknown;
    }
  }
}

void HidePatches(double share, uint64_t seed, OccupancyGrid* grid) {
  Random random(seed, 0);
  constexpr double kPatchM = 0.5;
  const Eigen::Vector3d size = grid->frame.cell_m * grid->frame.size.cast<double>();
  const double area_m2 = size.x() * size.y();
  const int count = static_cast<int>(share * area_m2 / (kPatchM * kPatchM));
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d low =
        grid->frame.origin_map +
        Eigen::Vector3d(random.Uniform(0.0, size.x()), random.Uniform(0.0, size.y()), 0.0);
    SetBox({low.x(), low.y(), 2.1}, {low.x() + kPatchM, low.y() + kPatchM, size.z()},
           Occupancy::kUnknown, grid);
  }
}

void AddPlaces(double spacing_m, RoomInput* input) {
  constexpr double kBodyM = 0.3;
  const OccupancyGrid plan = PlanOf(input->field->grid());
  const DistanceField field(plan);
  const double z_m = field.frame().origin_map.z() + 0.5 * field.frame().cell_m;
  const Eigen::Vector3d low = field.frame().origin_map;
  const Eigen::Vector3d high = low + field.frame().cell_m * field.frame().size.cast<double>();
  std::vector<Eigen::Vector3d> spots;
  for (double y = low.y() + 0.5 * spacing_m; y < high.y(); y += spacing_m) {
    for (double x = low.x() + 0.5 * spacing_m; x < high.x(); x += spacing_m) {
      const double clearance_m = field.ClearanceM({x, y, z_m});
      if (clearance_m < kBodyM) continue;
      spots.emplace_back(x, y, z_m);
      input->places.push_back({{x, y, input->floor_z_m}, clearance_m});
    }
  }
  for (size_t i = 0; i < spots.size(); ++i) {
    for (size_t j = i + 1; j < spots.size(); ++j) {
      if (spots[j].y() - spots[i].y() > 1.6 * spacing_m) break;
      if ((spots[j] - spots[i]).norm() > 1.6 * spacing_m) continue;
      const double clearance_m = field.SegmentClearanceM(spots[i], spots[j]);
      if (clearance_m < kBodyM) continue;
      input->links.push_back({static_cast<int>(i), static_cast<int>(j), clearance_m});
    }
  }
}

simulator::World MakeWorld(simulator::WorldKind kind, uint64_t seed) {
  simulator::WorldOptions options;
  options.kind = kind;
  options.seed = seed;
  auto world = simulator::GenerateWorld(options);
  DSG_CHECK(world.ok());
  return *std::move(world);
}

RoomInput InputOf(const DistanceField& field, double ceiling_m) {
  RoomInput input;
  input.field = &field;
  input.ceiling_z_m = ceiling_m;
  return input;
}

evaluation::RoomResult Score(const simulator::World& world, const OccupancyGrid& grid,
                             const RoomInput& input, const RoomLabelling& rooms) {
  evaluation::TrueRooms truth;
  for (const simulator::Room& room : world.plan.rooms) {
    const simulator::Rect& cell = room.cell;
    truth.footprints_map.push_back({cell.min(),
                                    {cell.max().x(), cell.min().y()},
                                    cell.max(),
                                    {cell.min().x(), cell.max().y()}});
  }
  for (const simulator::Door& door : world.plan.doors) {
    truth.doors.emplace_back(door.room_a, door.room_b);
  }
  evaluation::PredictedRooms predicted;
  predicted.count = static_cast<int>(rooms.rooms.size());
  for (size_t i = 0; i < input.places.size(); ++i) {
    predicted.places.push_back(
        {input.places[i].position_map, input.places[i].clearance_m, rooms.room_of_place[i]});
  }
  predicted.adjacent = rooms.adjacent;
  const truth::FreeGrid free = FreeGridOf(world, grid);
  const evaluation::GridMap map(&free);
  return evaluation::EvaluateRooms(predicted, truth, map, {});
}

std::string ToText(const evaluation::RoomResult& result) {
  const auto percent = [](const std::optional<double>& value) {
    return value.has_value() ? absl::StrCat(std::round(*value * 1000.0) / 10.0) : "-";
  };
  const auto both = [&](const evaluation::PrecisionRecall& score) {
    return absl::StrCat(percent(score.precision), "/", percent(score.recall));
  };
  return absl::StrCat("places ", both(result.of_places), " outside doors ",
                      both(result.outside_doors), " volumetric ", both(result.volumetric),
                      " one to one ", both(result.one_to_one), " count ", result.count.value_or(-1),
                      " of ", result.count_truth, " adjacency F1 ", percent(result.adjacency_f1));
}

void MaybeDraw(const std::string& name, const DistanceField& field, const RoomInput& input,
               const RoomLabelling& rooms) {
  const char* folder = std::getenv("DSG_PICTURES");
  if (folder == nullptr) return;
  const OccupancyGrid plan = PlanOf(field.grid());
  const double scale = std::max(1.0, std::floor(1600.0 / plan.frame.size.head<2>().maxCoeff()));
  const auto pixel = [&](const Eigen::Vector2d& point) -> Eigen::Vector2d {
    const Eigen::Vector2d at =
        (point - plan.frame.origin_map.head<2>()) / plan.frame.cell_m * scale;
    return {at.x(), plan.frame.size.y() * scale - at.y()};
  };
  dsg::picture::Canvas canvas(static_cast<int>(plan.frame.size.x() * scale),
                              static_cast<int>(plan.frame.size.y() * scale),
                              dsg::picture::MakePaint(0xFFFFFF));
  for (int64_t i = 0; i < plan.frame.CellCount(); ++i) {
    const Occupancy state = plan.cells[static_cast<size_t>(i)];
    if (state == Occupancy::kFree) continue;
    const Eigen::Vector2d at = plan.frame.Center(plan.frame.Cell(i)).head<2>();
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * scale);
    canvas.FillRect(pixel(at) - half, pixel(at) + half,
                    dsg::picture::MakePaint(state == Occupancy::kOccupied ? 0x303030 : 0xC8C8C8));
  }
  if (std::getenv("DSG_GAPS") != nullptr) {
    for (const WallGap& gap : FindWallGaps(DistanceField(plan), {})) {
      canvas.DrawPolyline({pixel(gap.from_map), pixel(gap.to_map)}, 4.0,
                          picture::MakePaint(0xFF0000));
    }
  }
  for (size_t room = 0; room < rooms.rooms.size(); ++room) {
    std::vector<Eigen::Vector2d> outline;
    for (const Eigen::Vector2d& corner : rooms.rooms[room].footprint_map) {
      outline.push_back(pixel(corner));
    }
    if (!outline.empty()) outline.push_back(outline.front());
    canvas.DrawPolyline(outline, 3.0, RoomPaint(static_cast<int>(room), 0.9f));
  }
  for (size_t i = 0; i < input.places.size(); ++i) {
    const int room = rooms.room_of_place[i];
    const Eigen::Vector2d at = pixel(input.places[i].position_map.head<2>());
    canvas.FillCircle(at, 5.0,
                      room < 0 ? dsg::picture::MakePaint(0x000000) : RoomPaint(room, 1.0f));
  }
  const auto png = dsg::picture::EncodePng(canvas.Halved());
  if (!png.ok()) return;
  std::ofstream(absl::StrCat(folder, "/", name, ".png"), std::ios::binary) << *png;
}

std::string DataPath(const std::string& name) {
  const char* folder = std::getenv("DSG_DATA");
  return absl::StrCat(folder != nullptr ? folder : DSG_SOURCE_DIR "/../shared/data", "/", name);
}

}  // namespace dsg::ingest
