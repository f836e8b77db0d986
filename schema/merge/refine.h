// SPDX-License-Identifier: Apache-2.0
// Refines the transform between two maps on surfaces: walls, floors and mesh. Corrects decimetres,
// and returns the transform unchanged where surfaces do not fit.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/align.h"

namespace dsg::merge {

/// A sighting of one spot or surface in both maps. A zero normal: the points are the same point;
/// otherwise the point of the other map lies on the plane.
struct Sighting {
  Eigen::Vector3d into = Eigen::Vector3d::Zero();
  Eigen::Vector3d other = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_into = Eigen::Vector3d::Zero();
  /// Standard deviation, metres.
  double sigma_m = 0.1;
};

/// The pose nearest to `map_T_other` (turning about z only) that fits the sightings best; those
/// that miss by several sigmas hardly count. Robust least squares (Cauchy), Gauss-Newton.
Pose3d FitSightings(const std::vector<Sighting>& sightings, const Pose3d& map_T_other);

/// Things and flat structures seen in both maps, under a transform that is right to decimetres.
std::vector<Sighting> CollectSightings(const MapContent& into, const MapContent& other,
                                       const Pose3d& map_T_other);

/// Points of the other map's mesh on surfaces of this one, at most `count_max`, spread evenly.
absl::StatusOr<std::vector<Sighting>> CollectSurface(const Snapshot& into, const Snapshot& other,
                                                     const Pose3d& map_T_other, int count_max,
                                                     const StopCheck& stop);

/// Where the other map was put when it was merged before, or else an estimate, refined on things,
/// structures and mesh.
/// Errors: as EstimateTransform; those of reading the maps.
absl::StatusOr<Alignment> FindTransform(const Snapshot& into, const Snapshot& other,
                                        const AlignOptions& options, const StopCheck& stop);

}  // namespace dsg::merge
