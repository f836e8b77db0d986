// SPDX-License-Identifier: Apache-2.0
// The skin's topology and where its vertices are on a body at rest.
// Refuses to bend anything; BodyModel does.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "ingest/simulator/body/body_model.h"

namespace dsg::simulator {

/// A vertex follows two joints; `weight` is the share of the second one, 0 to 0.6.
struct SkinBinding {
  uint8_t joint = 0;
  uint8_t second = 0;
  double weight = 0.0;
};

/// The same for all bodies.
struct SkinTopology {
  std::vector<std::array<uint32_t, 3>> faces;
  std::vector<SkinBinding> bindings;
};

/// Threads: safe; made once.
const SkinTopology& SkinTopologyOfAll();

/// Vertices of the upright body, torso frame. `scale` is its height over the mean height.
std::vector<Eigen::Vector3d> RestVertices(
    const std::array<Eigen::Vector3d, ingest::kJointCount>& rest_joints, const Girths& girths,
    double scale);

}  // namespace dsg::simulator
