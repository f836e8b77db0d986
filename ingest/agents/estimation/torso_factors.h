// SPDX-License-Identifier: Apache-2.0
// A torso graph's terms as factors of the store.
// Refuses the cues: they are no poses.
#pragma once

#include <Eigen/Core>

#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// Upper triangle of a matrix with these diagonal blocks; turns about the torso's axes.
Covariance6 BlockCovariance(const Eigen::Matrix3d& position, const Eigen::Matrix3d& turn);

/// Of one detection. `heading_sigma_rad` 0 = it gives none.
PoseFactor DetectionFactor(TimeNs time_ns, const Pose3d& map_T_torso,
                           const Eigen::Matrix3d& position_covariance_map, double heading_sigma_rad,
                           double tilt_sigma_rad);

/// Between neighbours: `step`, the variances of the position that it leaves open, and how much it
/// says of turns about the torso's axes (0 = nothing).
PoseFactor LinkFactor(const char* type, TimeNs from_ns, TimeNs to_ns, const Pose3d& step,
                      const Eigen::Vector3d& position_variance,
                      const Eigen::Vector3d& turn_information);

}  // namespace dsg::ingest
