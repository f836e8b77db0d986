// SPDX-License-Identifier: Apache-2.0
// Buildings as occupancy grids, their places, and how well rooms were found in them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ingest/evaluation/rooms.h"
#include "ingest/places/extract_places.h"
#include "ingest/rooms/find_rooms.h"
#include "ingest/simulator/world/world.h"

namespace dsg::ingest {

inline constexpr double kCellM = 0.1;

/// A storey to be drawn by hand: solid everywhere until rooms are carved.
class DrawnStorey {
 public:
  DrawnStorey(double width_m, double depth_m, double ceiling_m);

  /// Free from the floor to a height; the ceiling of the storey when left out.
  void Carve(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
             std::optional<double> top_m = std::nullopt);
  void Fill(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double bottom_m, double top_m);
  /// What nobody saw.
  void Hide(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double bottom_m, double top_m);
  const OccupancyGrid& grid() const { return grid_; }
  double ceiling_m() const { return ceiling_m_; }

 private:
  void Set(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Occupancy state);

  OccupancyGrid grid_;
  double ceiling_m_;
};

/// Walls, lintels, glass, ceilings and furniture of a simulated world.
OccupancyGrid GridOfWorld(const simulator::World& world);

/// Everything above a height unknown.
void HideAbove(double height_m, OccupancyGrid* grid);
/// A share of the columns unknown above head height, in patches half a metre wide.
void HidePatches(double share, uint64_t seed, OccupancyGrid* grid);

/// A place every so far where a body fits, linked to those around it in straight free reach.
void AddPlaces(double spacing_m, RoomInput* input);

simulator::World MakeWorld(simulator::WorldKind kind, uint64_t seed);

/// The grid's field must outlive the input.
RoomInput InputOf(const DistanceField& field, double ceiling_m);

/// `field`: of the world's grid, which knows the floor best.
evaluation::RoomResult Score(const simulator::World& world, const OccupancyGrid& grid,
                             const RoomInput& input, const RoomLabelling& rooms);
std::string ToText(const evaluation::RoomResult& result);

/// Writes a picture of rooms, places and outlines when DSG_PICTURES names a folder.
void MaybeDraw(const std::string& name, const DistanceField& field, const RoomInput& input,
               const RoomLabelling& rooms);

/// DSG_DATA or the folder beside the repository.
std::string DataPath(const std::string& name);

}  // namespace dsg::ingest
