// SPDX-License-Identifier: Apache-2.0
// Floors, walls and ceilings by class of room.
// Refuses furniture, whose looks come from the catalogue.
#pragma once

#include <string>

#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

struct RoomLook {
  Material floor;
  Color floor_color;
  Color wall_color;
  Material ceiling;
};

/// `hash` chooses among the colours that the class allows.
RoomLook RoomLookOf(const std::string& room_class, uint32_t hash);

}  // namespace dsg::simulator
