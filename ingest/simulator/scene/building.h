// SPDX-License-Identifier: Apache-2.0
// A building's walls, floors, ceilings, glass, door frames and lamps as parts of a scene.
// Refuses furniture.
#pragma once

#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

/// Appends to parts and fills lights.
void AddBuilding(const FloorPlan& plan, Scene* scene);

}  // namespace dsg::simulator
