// SPDX-License-Identifier: Apache-2.0
// How much light falls on a point of a surface: lamps under the ceiling, less in corners.
// Refuses shadows; what stands in between is not asked for.
#pragma once

#include <Eigen/Core>

#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

/// About 0.3 to 1. `normal` is of unit length.
float LightAt(const RoomLight& light, const Eigen::Vector3f& point_map,
              const Eigen::Vector3f& normal);

/// Where no room is.
float EvenLight(const Eigen::Vector3f& normal);

/// Null outside of all rooms.
const RoomLight* FindLight(const std::vector<RoomLight>& lights, const Eigen::Vector3f& point_map);

}  // namespace dsg::simulator
