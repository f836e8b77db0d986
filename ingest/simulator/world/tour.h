// SPDX-License-Identifier: Apache-2.0
// In which order to visit the rooms of a world without walking much.
// Refuses to promise the shortest tour; a good one is enough.
#pragma once

#include <vector>

#include "ingest/simulator/world/world.h"

namespace dsg::simulator {

/// Rooms that one stays in, by index: all that are no passages.
std::vector<int> RoomsToStay(const World& world);

/// The place of a room that is farthest from everything: a good spot to look around from.
int RoomiestPlace(const World& world, int room);

/// The rooms of RoomsToStay as a short round trip over the places graph: nearest neighbour, then
/// no two legs that would be shorter crossed over. Begins anywhere; the last is near the first.
///
/// Cost: one shortest-path tree a room, about 30 ms for the office.
std::vector<int> RoomTour(const World& world);

}  // namespace dsg::simulator
