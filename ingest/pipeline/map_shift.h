// SPDX-License-Identifier: Apache-2.0
// How the mesh moved, place by place: what has no time of its own moves with the mesh around it.
// Refuses to tilt: shifts turn about the vertical only.
#pragma once

#include <map>
#include <optional>

#include "schema/model/geometry.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// The turn of a rotation about the vertical, radians.
double YawOf(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond TurnAboutZ(double yaw_rad);

/// Threads: one caller at a time while it is filled, then safe.
class MapShift {
 public:
  /// A piece of surface was there and is now here.
  void Add(const Eigen::Vector3d& old_map, const Eigen::Vector3d& new_map, double yaw_rad);

  /// The mean shift of the mesh in and near a box; nullopt without mesh within 4 m.
  std::optional<Pose3d> Around(const Box3d& box_map) const;

 private:
  struct Cell {
    int64_t count = 0;
    Eigen::Vector3d old_sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d shift_sum = Eigen::Vector3d::Zero();
    double yaw_sum_rad = 0.0;
  };
  Cell SumOf(const Box3d& box_map) const;

  std::map<BlockIndex, Cell> cells_;
};

}  // namespace dsg::ingest
