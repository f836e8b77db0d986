// SPDX-License-Identifier: Apache-2.0
// Rooms as parts of the place graph that stay apart while obstacles grow.
// Refuses to look at cells: places and the clearances of their ways decide.
#pragma once

#include <vector>

#include "ingest/rooms/find_rooms.h"

namespace dsg::ingest {

/// For each place its room, numbered from 0 by first place; -1 = reached from none.
///
/// Ways are cut in order of their clearance. The number of parts with enough places that holds over
/// the longest range of clearances is the number of rooms; of equally long ranges the one with more
/// rooms counts. The rest of the places joins the part that it is reached from by the widest way.
/// Cost: links x log(links).
/// Source: Hughes, Chang and Carlone, "Hydra", RSS 2022, section IV.
std::vector<int> FiltrationRooms(size_t place_count, const std::vector<RoomLink>& links,
                                 const FiltrationOptions& options);

}  // namespace dsg::ingest
