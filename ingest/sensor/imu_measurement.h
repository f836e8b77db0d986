// SPDX-License-Identifier: Apache-2.0
// What an inertial unit measures.
#pragma once

#include <Eigen/Core>

#include "schema/base/time.h"

namespace dsg::ingest {

/// One sample of an inertial unit, in its own frame (the body, unless calibrated otherwise).
struct ImuMeasurement {
  TimeNs time_ns = 0;
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
  /// Specific force: what an accelerometer at rest shows is minus gravity.
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();
};

}  // namespace dsg::ingest
