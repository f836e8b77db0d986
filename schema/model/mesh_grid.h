// SPDX-License-Identifier: Apache-2.0
// The grid of positions and directions that meshes made from sensors are rounded to.
// A mesh on this grid is stored in an eighth of the bytes (schema/codec/mesh_codec.h); others are
// stored as they are.
#pragma once

#include <cstdint>

#include "schema/model/geometry.h"

namespace dsg {

/// Step of a coordinate. Rounding moves it by at most half a step, 0.05 mm; beyond about 800 m from
/// the origin the resolution of a float is coarser than that.
inline constexpr double kMeshStepM = 1e-4;
/// Steps from the middle of a side of the cube of directions to its border.
inline constexpr int kNormalSteps = 64;

/// A direction as a point on a side of the cube [-1, 1]^3.
struct NormalCode {
  /// The axis of the longest component, plus 3 where it is negative.
  uint8_t side = 0;
  /// Steps along the two next axes in cyclic order, -kNormalSteps to kNormalSteps.
  int8_t u = 0;
  int8_t v = 0;
  bool operator==(const NormalCode&) const = default;
};

/// Requires: |coordinate_m| < 1e14.
int64_t MeshStepsOf(double coordinate_m);
float MeshCoordinateOf(int64_t steps);
/// The nearest position on the grid.
Eigen::Vector3f RoundToMeshGrid(const Eigen::Vector3d& position_map);

/// The code nearest to a direction. Requires: a finite vector; zero gives +x.
NormalCode NormalCodeOf(const Eigen::Vector3f& normal_map);
/// A unit vector, within 0.7 degrees of each direction that has this code.
Eigen::Vector3f NormalOf(const NormalCode& code);

}  // namespace dsg
