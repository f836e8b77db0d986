// SPDX-License-Identifier: Apache-2.0
// Casts and shades the rays of one image.
// Refuses callers outside of this folder's .cc files.
#pragma once

#include "ingest/simulator/scene/body_scene_internal.h"
#include "ingest/simulator/scene/renderer.h"
#include "ingest/simulator/scene/static_scene_internal.h"

namespace dsg::simulator {

/// Fills what `wants` asks for. Requires: `view` knows its size, and its bodies if coverage is
/// asked for.
void DrawFrame(const StaticScene& world, const BodyScene& bodies, const RayCamera& camera,
               const ViewWants& wants, RenderedView* view);

}  // namespace dsg::simulator
