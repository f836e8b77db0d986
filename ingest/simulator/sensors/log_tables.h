// SPDX-License-Identifier: Apache-2.0
// The tables of a sensor log: everything of it but the images.
// Refuses to write log.json; that says that the log is whole, and comes last.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/simulator/body/detector.h"
#include "ingest/simulator/sensors/session.h"

namespace dsg::simulator {

/// Calibration, image lists, inertial samples, the robot's poses, detections, label colours.
/// Errors: of OutputFile.
absl::Status WriteLogTables(const SensorSession& session,
                            const std::vector<DetectionOutput>& detections,
                            const std::string& log_folder);

/// What log.json holds: format, version, how it was made, counts.
std::string LogJson(const SensorSession& session, size_t detection_count);

}  // namespace dsg::simulator
