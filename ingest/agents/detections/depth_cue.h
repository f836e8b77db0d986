// SPDX-License-Identifier: Apache-2.0
// Where the readings of a depth picture put a detected person's torso.
// Refuses to know the height of the pelvis: the visible part of a body does not tell it.
#pragma once

#include <optional>

#include "ingest/agents/detections/floor_cue.h"
#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

/// The middle of the trunk's visible surface, half a body further from the camera; distance and
/// side, not height. nullopt when the picture shows too little of the person.
/// Cost: some hundred microseconds.
std::optional<PositionCue> DepthImageCue(const PlacedBody& body, const DepthFrame& depth);

}  // namespace dsg::ingest
