// SPDX-License-Identifier: Apache-2.0
// Where a body of 0.1 to 1.8 m height can be, cell by cell: the truth for places and rooms.
// Refuses to say what a camera saw of it; observation.h does.
#pragma once

#include "ingest/simulator/scene/scene.h"
#include "ingest/simulator/world/world.h"
#include "ingest/truth/truth.h"

namespace dsg::simulator {

/// Occupancy of the static scene between 0.1 and 1.8 m above the floor. Free is what can be
/// reached from `inside` through free cells: the hollow of a cupboard is not. Cells within 0.4 m
/// of a door's line carry the door band.
truth::FreeGrid MakeFreeGrid(const World& world, const Scene& scene, const Point& inside);

}  // namespace dsg::simulator
