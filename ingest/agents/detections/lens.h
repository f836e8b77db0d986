// SPDX-License-Identifier: Apache-2.0
// The ray through a pixel of a camera with distortion.
// Refuses pixels that no ray gives.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// z = 1, camera frame, distortion taken off; nullopt where no ray gives that pixel.
std::optional<Eigen::Vector3d> RayThrough(const CameraCalibration& camera,
                                          const Eigen::Vector2d& pixel);

}  // namespace dsg::ingest
