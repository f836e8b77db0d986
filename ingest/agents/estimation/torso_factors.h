// SPDX-License-Identifier: Apache-2.0
// A torso graph's terms as factors of the store.
// Refuses the cues: they are no poses.
#pragma once

#include <Eigen/Core>

#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// Upper triangle of a matrix with these diagonal blocks; heading about the torso's z axis.
Covariance6 BlockCovariance(const Eigen::Matrix3d& position, double tilt, double heading);

/// Of one detection. `heading_sigma_rad` 0 = it gives none.
PoseFactor DetectionFactor(TimeNs time_ns, const Pose3d& map_T_torso,
                           const Eigen::Matrix3d& position_covariance_map, double heading_sigma_rad,
                           double tilt_sigma_rad);

/// Between neighbours: `step` and the variances of what it leaves open.
PoseFactor LinkFactor(const char* type, TimeNs from_ns, TimeNs to_ns, const Pose3d& step,
                      const Eigen::Vector3d& position_variance, double heading_variance);

}  // namespace dsg::ingest
