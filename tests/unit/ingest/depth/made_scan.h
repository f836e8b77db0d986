// SPDX-License-Identifier: Apache-2.0
// Scans of a lidar with 16 beams in an empty room with a pillar, made by casting rays.
// Refuses noise: a test adds the one that it is about.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Inside: x -3 to 4, y -2 to 5, z 0 to 2.5.
inline Box3d MadeRoom() {
  return Box3d(Eigen::Vector3d(-3.0, -2.0, 0.0), Eigen::Vector3d(4.0, 5.0, 2.5));
}
inline Box3d MadePillar() {
  return Box3d(Eigen::Vector3d(1.5, 0.5, 0.0), Eigen::Vector3d(1.9, 0.9, 2.5));
}

/// How far a ray from within the room goes before it meets something, in units of `way`.
inline double HitOf(const Eigen::Vector3d& from, const Eigen::Vector3d& way) {
  const Box3d room = MadeRoom();
  const Box3d pillar = MadePillar();
  double wall = std::numeric_limits<double>::infinity();
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double end = way[axis] > 0.0 ? room.max()[axis] : room.min()[axis];
    if (way[axis] != 0.0) wall = std::min(wall, (end - from[axis]) / way[axis]);
    double near = (pillar.min()[axis] - from[axis]) / way[axis];
    double far = (pillar.max()[axis] - from[axis]) / way[axis];
    if (near > far) std::swap(near, far);
    enter = std::max(enter, near);
    leave = std::min(leave, far);
  }
  return enter < leave && enter > 0.0 ? std::min(wall, enter) : wall;
}

/// Distance of a point from the nearest surface, metres.
inline double OffSurface(const Eigen::Vector3d& point) {
  double off = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double wall : {MadeRoom().min()[axis], MadeRoom().max()[axis]}) {
      off = std::min(off, std::abs(point[axis] - wall));
    }
  }
  const Box3d pillar = MadePillar();
  if (!pillar.contains(point)) return std::min(off, pillar.exteriorDistance(point));
  for (int axis = 0; axis < 2; ++axis) {
    off = std::min({off, point[axis] - pillar.min()[axis], pillar.max()[axis] - point[axis]});
  }
  return off;
}

/// In the lidar's frame: 16 beams from -15 to 15 degrees, 1800 points around. Order: by beam.
inline std::vector<Eigen::Vector3f> MadeScan(const Pose3d& map_T_lidar) {
  std::vector<Eigen::Vector3f> points;
  constexpr double kDegree = std::numbers::pi / 180.0;
  for (int beam = 0; beam < 16; ++beam) {
    const double up = (-15.0 + 2.0 * beam) * kDegree;
    for (int i = 0; i < 1800; ++i) {
      const double turn = (0.2 * i + 0.013) * kDegree;
      const Eigen::Vector3d way(std::cos(up) * std::cos(turn), std::cos(up) * std::sin(turn),
                                std::sin(up));
      const double far = HitOf(map_T_lidar.position, map_T_lidar.orientation * way);
      points.push_back((far * way).cast<float>());
    }
  }
  return points;
}

}  // namespace dsg::ingest
