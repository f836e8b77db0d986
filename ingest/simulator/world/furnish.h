// SPDX-License-Identifier: Apache-2.0
// Puts the catalogue's furniture into a floor plan.
// Refuses a position that overlaps, blocks a door, or cuts off part of a room.
#pragma once

#include <string>
#include <vector>

#include "ingest/simulator/world/floor_plan.h"
#include "schema/base/random.h"
#include "schema/model/node.h"

namespace dsg::simulator {

/// A box of furniture.
struct Furniture {
  std::string class_name;
  /// Unique in the world: "fridge", "chair 12".
  std::string name;
  int room = 0;
  /// Index of the piece it stands on; -1 = the floor, or it hangs on a wall.
  int on = -1;
  /// Middle of the box, map frame.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  /// In the piece's own frame, whose y axis is its front.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Turns to the left of that frame against the map, 0 to 3.
  int quarter_turns = 0;
  Color color = {128, 128, 128, 255};

  /// Height of its underside above the floor.
  double BaseM() const { return center.z() - 0.5 * size.z(); }
  /// In the way of walkers: it neither stands on another piece nor hangs on a wall.
  bool StandsOnFloor() const { return on < 0 && BaseM() < 0.01; }
  /// What it covers of the floor, map frame.
  Rect Footprint() const {
    Point half(0.5 * size.x(), 0.5 * size.y());
    if (quarter_turns % 2 == 1) std::swap(half.x(), half.y());
    return Rect(center.head<2>() - half, center.head<2>() + half);
  }
};

/// At most this many pieces of a class in a world, so that eight bits count them.
inline constexpr int kPiecesOfClassMax = 255;

/// Order: by room; what stands on a piece comes after it. Not yet named.
std::vector<Furniture> Furnish(const FloorPlan& plan, Random* random);

/// Adds what hangs on walls and lies on tables; nothing of it is in the way of walkers. Order: by
/// room, after all that was there.
void Decorate(const FloorPlan& plan, Random* random, std::vector<Furniture>* furniture);

/// Gives each piece a name: its class, with a number where there are several.
void NameFurniture(std::vector<Furniture>* furniture);

/// Walls, pillars and all furniture that stands on the floor.
FreeSpace FreeSpaceOf(const FloorPlan& plan, const std::vector<Furniture>& furniture);

}  // namespace dsg::simulator
