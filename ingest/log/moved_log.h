// SPDX-License-Identifier: Apache-2.0
// A log whose poses are moved into the frame of the map.
// Refuses ready-made graphs, which hold more than poses.
#pragma once

#include <memory>

#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// The same log with poses `map_T_log` * pose, and covariances in the axes of the map.
/// Errors of Next: INVALID_ARGUMENT/FIELD_INVALID for a piece of a graph; of the log.
std::unique_ptr<LogSource> MoveLog(std::unique_ptr<LogSource> log, const Pose3d& map_T_log);

}  // namespace dsg::ingest
