// SPDX-License-Identifier: Apache-2.0
// EuRoC's table of inertial samples: stamp [ns], angular rate [rad/s], specific force [m/s^2].
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/sensor_log.h"

namespace dsg::ingest {

/// Errors: FILE_MALFORMED naming file, line, field and value.
absl::StatusOr<SensorChannel> ReadImuTable(const LogFile& file, const std::string& channel);

}  // namespace dsg::ingest
