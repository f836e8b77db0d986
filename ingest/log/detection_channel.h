// SPDX-License-Identifier: Apache-2.0
// The human detections of a folder log: checked when the log is opened, read again one by one.
// Refuses to keep them all in memory: an hour among sixty people fills gigabytes.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/sensor_log.h"

namespace dsg::ingest {

/// `path`: one detection a line, ascending by time, then id. An empty file is a log of an empty
/// building. `channel` is its name in the log. The faces of bodies, topology.json beside it, go
/// into `info`.
/// Errors: FILE_MALFORMED naming file, line, field and value; of CheckBody.
absl::StatusOr<SensorChannel> ReadDetectionChannel(const std::string& path,
                                                   const std::string& channel,
                                                   const LogOptions& options, LogDigest* digest,
                                                   LogInfo* info);

}  // namespace dsg::ingest
