// SPDX-License-Identifier: Apache-2.0
// Walls, glass, floors, ceilings and pillars around the rooms of a plan.
// Refuses to decide where rooms, doors or glass go.
#pragma once

#include <vector>

#include "ingest/simulator/world/floor_plan.h"

namespace dsg::simulator {

/// Glass in place of a piece of wall between two rooms, from the floor to the ceiling.
struct GlassFront {
  int room_a = 0;
  int room_b = 0;
  /// Both halves of the wall.
  Rect rect;
};

struct Pillar {
  int room = 0;
  Rect rect;
};

/// Each room's half of its walls with openings and glass, lintels over doors, floor, ceiling and
/// pillars. Order: by room. Requires: openings and glass of one wall do not overlap.
std::vector<Structure> DrawShell(const std::vector<Room>& rooms, const std::vector<Door>& doors,
                                 const std::vector<GlassFront>& glass,
                                 const std::vector<Pillar>& pillars);

/// Gives each room a name: its class, with a number where there are several.
void NameRooms(std::vector<Room>* rooms);

/// Rounded, so that plans are in whole centimetres.
double Centimetres(double metres);

}  // namespace dsg::simulator
