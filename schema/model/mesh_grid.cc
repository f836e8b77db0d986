// SPDX-License-Identifier: Apache-2.0
#include "schema/model/mesh_grid.h"

#include <cmath>

namespace dsg {

int64_t MeshStepsOf(double coordinate_m) { return std::llround(coordinate_m / kMeshStepM); }

float MeshCoordinateOf(int64_t steps) {
  return static_cast<float>(static_cast<double>(steps) * kMeshStepM);
}

Eigen::Vector3f RoundToMeshGrid(const Eigen::Vector3d& position_map) {
  return {MeshCoordinateOf(MeshStepsOf(position_map.x())),
          MeshCoordinateOf(MeshStepsOf(position_map.y())),
          MeshCoordinateOf(MeshStepsOf(position_map.z()))};
}

NormalCode NormalCodeOf(const Eigen::Vector3f& normal_map) {
  const Eigen::Vector3d normal = normal_map.cast<double>();
  int axis = 0;
  const double longest = normal.cwiseAbs().maxCoeff(&axis);
  if (!(longest > 0.0)) return {};
  const auto steps = [&](int other) {
    return static_cast<int8_t>(std::lround(normal[other] / longest * kNormalSteps));
  };
  return {static_cast<uint8_t>(normal[axis] < 0.0 ? axis + 3 : axis), steps((axis + 1) % 3),
          steps((axis + 2) % 3)};
}

Eigen::Vector3f NormalOf(const NormalCode& code) {
  const int axis = code.side % 3;
  const double u = static_cast<double>(code.u) / kNormalSteps;
  const double v = static_cast<double>(code.v) / kNormalSteps;
  const double length = std::sqrt(u * u + v * v + 1.0);
  Eigen::Vector3f normal;
  normal[axis] = static_cast<float>((code.side < 3 ? 1.0 : -1.0) / length);
  normal[(axis + 1) % 3] = static_cast<float>(u / length);
  normal[(axis + 2) % 3] = static_cast<float>(v / length);
  return normal;
}

}  // namespace dsg
