// SPDX-License-Identifier: Apache-2.0
// Recorded samples and the true states beside them, of folders in EuRoC's layout.
#pragma once

#include <string>
#include <vector>

#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/time.h"

namespace dsg::ingest {

struct TrueState {
  TimeNs time_ns = 0;
  InertialState state;
};

struct EurocTables {
  std::vector<ImuMeasurement> samples;
  std::vector<TrueState> truth;
};

/// Of a folder below DSG_DATA; empty tables when it is not there.
EurocTables ReadEuroc(const std::string& folder);

}  // namespace dsg::ingest
