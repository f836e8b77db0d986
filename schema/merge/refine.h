// SPDX-License-Identifier: Apache-2.0
// Refines the transform between two maps on surfaces: walls, floors and mesh. Corrects decimetres,
// and returns the transform unchanged where surfaces do not fit.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/align.h"

namespace dsg::merge {

/// One spot or surface in both maps. With a zero normal both points are the same point; otherwise
/// the point of the other map lies on the plane.
struct Sighting {
  Eigen::Vector3d into = Eigen::Vector3d::Zero();
  Eigen::Vector3d other = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_into = Eigen::Vector3d::Zero();
  /// Standard deviation, metres.
  double sigma_m = 0.1;
};

/// Fits the transform to the sightings, beginning at `map_T_other` and turning about z only. Gauss-
/// Newton with a Cauchy loss.
Pose3d FitSightings(const std::vector<Sighting>& sightings, const Pose3d& map_T_other);

/// Things and flat structures in both maps, given a transform that is accurate to decimetres.
std::vector<Sighting> CollectSightings(const MapContent& into, const MapContent& other,
                                       const Pose3d& map_T_other);

/// Points of the other map's mesh on surfaces of this one, spread evenly, at most `count_max`.
absl::StatusOr<std::vector<Sighting>> CollectSurface(const Snapshot& into, const Snapshot& other,
                                                     const Pose3d& map_T_other, int count_max,
                                                     const StopCheck& stop);

/// The transform of the last merge, or else an estimate, refined on things, structures and mesh.
/// Errors: as EstimateTransform; those of reading the maps.
absl::StatusOr<Alignment> FindTransform(const Snapshot& into, const Snapshot& other,
                                        const AlignOptions& options, const StopCheck& stop);

}  // namespace dsg::merge
