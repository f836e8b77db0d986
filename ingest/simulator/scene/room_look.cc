// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/room_look.h"

namespace dsg::simulator {

RoomLook RoomLookOf(const std::string& room_class, uint32_t hash) {
  static constexpr Color kWalls[] = {{206, 200, 188, 255},
                                     {186, 196, 200, 255},
                                     {212, 204, 178, 255},
                                     {190, 202, 184, 255},
                                     {204, 190, 186, 255}};
  static constexpr Color kCarpets[] = {
      {96, 104, 122, 255}, {118, 106, 98, 255}, {92, 112, 108, 255}, {122, 96, 92, 255}};
  const Color wall = kWalls[hash % 5];
  if (room_class == "kitchen" || room_class == "restroom" || room_class == "bathroom" ||
      room_class == "lobby") {
    return {Material::kTiles, {168, 164, 156, 255}, wall, Material::kTiles};
  }
  if (room_class == "living room" || room_class == "bedroom" || room_class == "lounge" ||
      room_class == "hallway" || room_class == "library" || room_class == "study") {
    return {Material::kWood, {156, 116, 78, 255}, wall, Material::kPlaster};
  }
  return {Material::kCarpet, kCarpets[(hash >> 8) % 4], wall, Material::kTiles};
}

}  // namespace dsg::simulator
