// SPDX-License-Identifier: Apache-2.0
// Folders of sensors in EuRoC's layout (docs/sensor_logs.md): tables now, images when asked for.
// Refuses a simulation that is not finished, and a table that names images which are not there.
#pragma once

#include <string>

#include "ingest/log/readers.h"

namespace dsg::ingest {

/// The folder that holds cam0/, imu0/, ...: `folder` or its mav0/; empty if neither does.
std::string FindSensorRoot(const std::string& folder);

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line and what to do.
OpenedLog OpenSensorFolder(const std::string& folder, const LogOptions& options);

}  // namespace dsg::ingest
