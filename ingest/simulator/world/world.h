// SPDX-License-Identifier: Apache-2.0
// A generated world: floor plan, furniture and places, made from one seed.
// Refuses to hold anything that moves.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "ingest/simulator/world/floor_plan.h"
#include "ingest/simulator/world/free_space.h"
#include "ingest/simulator/world/furnish.h"
#include "ingest/simulator/world/options.h"
#include "ingest/simulator/world/place_graph.h"

namespace dsg::simulator {

/// Immutable once made.
struct World {
  WorldKind kind = WorldKind::kWing;
  FloorPlan plan;
  std::vector<Furniture> furniture;
  FreeSpace free_space;
  PlaceGraph places;

  Rect Bounds() const;
};

/// Same options, same world.
///
/// Errors: INTERNAL when a seed yields a room that cannot be reached; tell the seed to us.
absl::StatusOr<World> GenerateWorld(const WorldOptions& options);

}  // namespace dsg::simulator
