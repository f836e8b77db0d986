// SPDX-License-Identifier: Apache-2.0
// Which way is up in a log whose poses are in any frame, told by floors and walls.
// Refuses to answer when what the camera saw fits two answers.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

/// Unit vector that points up, in the frame of the frames' poses (which need not be the map's);
/// nullopt when doubtful.
///
/// Takes for granted that the camera was held upright: up is within 75 degrees of the images'
/// mean up, and the images' rows are about level. Of the directions left, up is the one that most
/// surfaces are level or upright to, refined by least squares over those surfaces.
/// Cost: about 40 ms for any number of frames; a dozen frames that look around are enough.
/// Errors: nullopt also when nothing level was seen, or hardly any flat surface.
std::optional<Eigen::Vector3d> EstimateUp(const std::vector<DepthFrame>& frames);

}  // namespace dsg::ingest
