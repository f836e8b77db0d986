// SPDX-License-Identifier: Apache-2.0
// Rooms, doors and walls: a building before anything stands in it.
// Refuses to know about furniture, places or people.
#pragma once

#include <string>
#include <vector>

#include "ingest/simulator/catalogue.h"
#include "ingest/simulator/free_space.h"
#include "ingest/simulator/random.h"

namespace dsg::simulator {

/// Walls stand this far to each side of the line between two rooms.
inline constexpr double kHalfWallM = 0.075;
inline constexpr double kDoorHeightM = 2.1;

/// A room; the spine (corridor, hallway) is one too, with index 0.
struct Room {
  std::string class_name;
  /// Unique in the world: "kitchen", "office 3".
  std::string name;
  /// Up to the middle of the walls. Cells tile the building.
  Rect cell;

  /// The floor between the walls.
  Rect Interior() const { return Inflate(cell, -kHalfWallM); }
  /// Low edges belong to the room, high ones to its neighbour, as in PolygonContains.
  bool Contains(const Point& point) const {
    return (point.array() >= cell.min().array()).all() &&
           (point.array() < cell.max().array()).all();
  }
};

/// An opening in the wall between a room and the spine, across the x axis: one walks along y.
struct Door {
  int room = 0;
  /// On the line between the two cells.
  Point center = Point::Zero();
  double width_m = 0.0;

  /// What a wall would cover if the door were none.
  Rect Opening() const {
    const Point half(0.5 * width_m, kHalfWallM);
    return Rect(center - half, center + half);
  }
};

/// A flat piece of a room's shell. Each room owns its half of a wall.
struct Structure {
  /// "wall", "floor" or "ceiling".
  std::string type;
  int room = 0;
  Rect rect;
  double z_min_m = 0.0;
  double z_max_m = 0.0;
  /// Unit, into the room; on the inner face n.x + d = 0.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset_m = 0.0;

  /// In the way of walkers; a lintel is not.
  bool IsObstacle() const { return type == "wall" && z_min_m < kDoorHeightM; }
};

struct FloorPlan {
  std::string building_name;
  double ceiling_m = 0.0;
  std::vector<Room> rooms;
  std::vector<Door> doors;
  std::vector<Structure> structures;

  /// Index of the room whose cell holds the point; -1 outside of the building.
  int RoomAt(const Point& point) const;
};

/// Draws a plan. Frames: map, origin at the building's low corner, spine along x.
FloorPlan DrawFloorPlan(const PlanSpec& spec, Random* random);

}  // namespace dsg::simulator
