// SPDX-License-Identifier: Apache-2.0
// From regions of a plan to rooms of places.
// Refuses to move places or regions.
#pragma once

#include <utility>
#include <vector>

#include "ingest/rooms/find_rooms.h"
#include "ingest/rooms/plan_regions.h"

namespace dsg::ingest {

/// The region under each place; places over none take what most of their neighbours have, all at
/// once, until nothing changes. Ties go to the widest way. -1 = no way to a labelled place.
/// Source: RSS 2020, section IV-C.
std::vector<int> RoomsOfPlaces(const std::vector<RoomPlace>& places,
                               const std::vector<RoomLink>& links, const PlanRegions& regions);

/// Pairs of rooms that some link crosses between, low index first, ascending. A link that passes
/// through a third room joins neither end with the other, but each with it.
std::vector<std::pair<int, int>> AdjacentRooms(const std::vector<RoomPlace>& places,
                                               const std::vector<RoomLink>& links,
                                               const std::vector<int>& room_of_place,
                                               const PlanRegions& regions);

/// Pairs of rooms that some link joins places of, low index first, ascending.
/// Source: RSS 2020, section IV-C.
std::vector<std::pair<int, int>> LinkedRooms(const std::vector<RoomLink>& links,
                                             const std::vector<int>& room_of_place);

/// Share of the places on which two labellings differ, rooms matched by what they share most of.
double Disagreement(const std::vector<int>& a, const std::vector<int>& b);

}  // namespace dsg::ingest
