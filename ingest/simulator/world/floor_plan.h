// SPDX-License-Identifier: Apache-2.0
// Rooms, doors and walls: a building before anything stands in it.
// Refuses to know about furniture, places or people.
#pragma once

#include <string>
#include <vector>

#include "ingest/simulator/world/catalogue.h"
#include "ingest/simulator/world/free_space.h"
#include "schema/base/random.h"

namespace dsg::simulator {

/// Walls stand this far to each side of the line between two rooms.
inline constexpr double kHalfWallM = 0.075;
inline constexpr double kDoorHeightM = 2.1;

/// A room; corridors and hallways are rooms too.
struct Room {
  std::string class_name;
  /// Unique in the world: "kitchen", "office 3".
  std::string name;
  /// Up to the middle of the walls. Cells tile the building.
  Rect cell;
  /// Height of its ceiling above the floor.
  double ceiling_m = 0.0;
  /// Where one passes through rather than stays: corridors, hallways.
  bool is_passage = false;

  /// The floor between the walls.
  Rect Interior() const { return Inflate(cell, -kHalfWallM); }
  /// Low edges belong to the room, high ones to its neighbour, as in PolygonContains.
  bool Contains(const Point& point) const {
    return (point.array() >= cell.min().array()).all() &&
           (point.array() < cell.max().array()).all();
  }
};

enum class OpeningKind {
  /// As high as the door; a wall goes on above.
  kDoor,
  /// As high as the ceiling.
  kFullHeight,
};

/// A way through the wall between two rooms.
struct Door {
  /// Indices of rooms, the first one less.
  int room_a = 0;
  int room_b = 0;
  /// On the line between the two cells.
  Point center = Point::Zero();
  double width_m = 0.0;
  /// Whether one walks through it along y (its wall runs along x).
  bool walks_along_y = true;
  OpeningKind kind = OpeningKind::kDoor;

  bool Joins(int room) const { return room == room_a || room == room_b; }
  /// The room on the other side. Requires: Joins(room).
  int Other(int room) const { return room == room_a ? room_b : room_a; }
  /// What a wall would cover if the door were none.
  Rect Opening() const {
    const Point half =
        walks_along_y ? Point(0.5 * width_m, kHalfWallM) : Point(kHalfWallM, 0.5 * width_m);
    return Rect(center - half, center + half);
  }
};

/// A flat piece of a room's shell, or a pillar in it. Each room owns its half of a wall.
struct Structure {
  /// "wall", "glass", "floor", "ceiling", "pillar". Glass stands as a wall does.
  std::string type;
  int room = 0;
  Rect rect;
  double z_min_m = 0.0;
  double z_max_m = 0.0;
  /// Unit, into the room; on the inner face n.x + d = 0. Zero for pillars.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset_m = 0.0;

  /// In the way of walkers; a lintel is not.
  bool IsObstacle() const {
    return (type == "wall" || type == "glass" || type == "pillar") && z_min_m < kDoorHeightM;
  }
};

struct FloorPlan {
  std::string building_name;
  /// Of the highest room; Room::ceiling_m tells each one's.
  double ceiling_m = 0.0;
  std::vector<Room> rooms;
  std::vector<Door> doors;
  std::vector<Structure> structures;

  /// Index of the room whose cell holds the point; -1 outside of the building.
  int RoomAt(const Point& point) const;
};

/// Draws a plan of rooms on both sides of a spine (wing, apartment). Frames: map, origin at the
/// building's low corner, spine along x.
FloorPlan DrawSpinePlan(const PlanSpec& spec, Random* random);

/// Draws the 65 m x 65 m office: a loop and grid of corridors, 30 to 50 rooms between them by
/// recursive subdivision, one or two open halls with pillars, some full-height openings and glass
/// fronts. Frames: map, origin at the building's low corner.
/// Source: RSS 2020, section VI-A (the office of the paper's evaluation).
FloorPlan DrawOfficePlan(Random* random);

}  // namespace dsg::simulator
