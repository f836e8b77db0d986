// SPDX-License-Identifier: Apache-2.0
// A log whose poses are turned into a frame with z up.
// Refuses to turn ready-made graphs, which have a frame of their own.
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// The same log with poses `map_R_log` * pose.
std::unique_ptr<LogSource> TurnLog(std::unique_ptr<LogSource> log,
                                   const Eigen::Quaterniond& map_R_log);

}  // namespace dsg::ingest
