// SPDX-License-Identifier: Apache-2.0
// A world as a scene graph. Refuses agents: those come with the log.
#pragma once

#include "ingest/simulator/world/world.h"
#include "schema/model/graph_delta.h"

namespace dsg::simulator {

/// Ids in the scene graph of what the world holds at an index.
inline NodeId ObjectId(int index) { return NodeId('O', static_cast<uint64_t>(index)); }
inline NodeId PlaceId(int index) { return NodeId('p', static_cast<uint64_t>(index)); }
inline NodeId StructureId(int index) { return NodeId('S', static_cast<uint64_t>(index)); }
inline NodeId RoomId(int index) { return NodeId('R', static_cast<uint64_t>(index)); }
inline NodeId BuildingId() { return NodeId('B', 0); }

/// Layers, labels, nodes and edges, true at all times; neither map nor session is set. Objects are
/// contained in the nearest place of their room, places in rooms, rooms in the building B0;
/// relations that go both ways are written once, from the lower id.
GraphDelta WorldGraph(const World& world);

}  // namespace dsg::simulator
