// SPDX-License-Identifier: Apache-2.0
// The stock of the generated worlds: semantic classes, furniture groups and what each kind of
// room holds. Plain tables; refuses to place anything.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ingest/simulator/world/options.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"

namespace dsg::simulator {

/// All classes of all worlds, ascending by id: structures from 1, objects from 10, rooms from 100,
/// buildings from 200.
const std::vector<SemanticLabel>& Labels();

/// Requires: a name from Labels().
int32_t ClassId(std::string_view class_name);

/// Colours in which an object of the class may come; never empty.
std::vector<Color> ColorsOf(std::string_view class_name);

/// One piece of a furniture group. Frame of the group: u along the wall, v away from it, origin on
/// the wall (or in the middle, for groups that stand free).
struct Piece {
  const char* class_name;
  /// Middle of the piece, metres.
  double u;
  double v;
  /// Along u, v and up at zero turns, metres.
  double size_u;
  double size_v;
  double size_z;
  /// Quarter turns to the left; at zero the piece faces along v.
  int quarter_turns = 0;
  /// Index in the group of the piece it stands on; -1 = the floor.
  int on = -1;
  /// How often it is there at all.
  double probability = 1.0;
};

enum class Placement {
  kWall,
  /// Near the middle of the room.
  kCenter,
  /// Somewhere on the floor, away from the walls.
  kFloor,
};

/// How many of which group a room gets.
struct GroupCount {
  std::span<const Piece> group;
  Placement placement;
  int min;
  int max;
  /// One more for each so many square metres beyond kExtraFromM2; 0 = never.
  double m2_per_extra = 0.0;
};

inline constexpr double kExtraFromM2 = 36.0;

/// What hangs on walls: size along the wall, off it and up, and height of its lower edge.
struct HungPiece {
  const char* class_name;
  double size_u;
  double size_v;
  double size_z;
  double base_m;
};

/// How many of a hung piece a room gets.
struct HungCount {
  HungPiece piece;
  int min;
  int max;
};

/// Empty for rooms with bare walls.
const std::vector<HungCount>& HungOf(std::string_view room_class);

/// What lies about on tables: at most one of each on a piece of the class that carries it.
struct LooseItem {
  const char* class_name;
  const char* on_class;
  double probability;
  double size_u;
  double size_v;
  double size_z;
};

const std::vector<LooseItem>& LooseItems();

/// In order of placement: what matters most comes first. Requires: a room class from Labels().
const std::vector<GroupCount>& FurnitureOf(std::string_view room_class);

struct RoomSpec {
  const char* class_name;
  int count;
  /// Along the spine, metres, before stretching to fill the side.
  double width_m_min;
  double width_m_max;
};

/// What a spine plan is drawn from: rooms on both sides of a passage.
struct PlanSpec {
  const char* building_name;
  const char* spine_class;
  double spine_width_m;
  double room_depth_m_min;
  double room_depth_m_max;
  double ceiling_m;
  double door_width_m;
  std::vector<RoomSpec> rooms;
};

/// Requires: a world with a spine (wing, apartment).
const PlanSpec& PlanSpecOf(WorldKind kind);

}  // namespace dsg::simulator
