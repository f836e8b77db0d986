// SPDX-License-Identifier: Apache-2.0
// Which rooms a wall, floor or ceiling bounds, and what a thing hangs on.
// Refuses to guess across walls: a wall bounds the room that it faces.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "ingest/rooms/find_rooms.h"
#include "ingest/rooms/structure.h"

namespace dsg::ingest {

/// Pairs (piece, room), ascending: the piece runs along the room's outline near it, faces it, and
/// is at its height. Floors, ceilings and pillars: lie over or under it, or in it.
std::vector<std::pair<int, int>> EnclosesOf(const std::vector<StructurePiece>& pieces,
                                            const std::vector<FoundRoom>& rooms,
                                            const StructureOptions& options);

/// The wall, ceiling or pillar that a thing hangs on: nearest of those near its box, which has its
/// middle at the origin of `map_T_box`.
/// Requires: it stands neither on the floor nor on another thing.
std::optional<int> AttachedTo(const Pose3d& map_T_box, const Eigen::Vector3d& size,
                              const std::vector<StructurePiece>& pieces,
                              const StructureOptions& options);

}  // namespace dsg::ingest
